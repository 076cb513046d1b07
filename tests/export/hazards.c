/* What firmware meets: readings and commands that are no numbers, glitches, structures of zeros. Prints a line per case,
   a name and numbers, for the tests to judge. */
#include "wheelpend_model.h"

#include <stdio.h>
#include <string.h>

static wp_machine machine;
static wp_observer observer;
static wp_identifier identifier;
static wp_real output[WP_OUTPUTS];
static unsigned long noise = 1;

/* A Gaussian number, nearly: twelve of a generator of whole numbers. */
static double scatter(void) {
    double sum = -6.0;
    for (int i = 0; i < 12; i++) {
        noise = (noise * 1103515245UL + 12345UL) & 0x7fffffffUL;
        sum += (double)noise / 2147483648.0;
    }
    return sum;
}

static void begin(void) {
    wp_real state[WP_STATES] = {WP_R(0.0)};
    state[1] = WP_R(0.02);
    wp_machine_init(&machine);
    wp_observer_init(&observer);
    wp_identifier_init(&identifier);
    wp_machine_start(&machine, state, WP_R(0.0));
    wp_observer_start(&observer, state, WP_R(0.0));
    wp_identifier_start(&identifier, state, WP_R(0.0));
    wp_machine_read(&machine, output);
}

/* Samples under a controller of the true state; readings get noise, and one of them the bad value. */
static unsigned run(int samples, int channel, wp_real bad, wp_real command_added, int bad_samples, int identifies) {
    unsigned taken = 7;
    for (int k = 0; k < samples; k++) {
        wp_real measured[WP_OUTPUTS];
        for (int y = 0; y < WP_OUTPUTS; y++) {
            measured[y] = output[y] + (wp_real)scatter() / observer.weight[y];
        }
        if (k < bad_samples && channel >= 0) {
            measured[channel] += bad;
        }
        const unsigned now = (unsigned)wp_observer_update(&observer, measured);
        if (identifies) {
            taken &= (unsigned)wp_identifier_update(&identifier, measured);
        }
        taken &= now;
        const wp_real command = WP_R(168.0) * machine.now[1] + WP_R(18.0) * machine.now[3];
        const wp_real given = k < bad_samples ? command + command_added : command;
        wp_observer_predict(&observer, given);
        if (identifies) {
            wp_identifier_predict(&identifier, given);
        }
        wp_machine_step(&machine, k < bad_samples ? command + command_added : command, output);
    }
    return taken;
}

static double far_off(void) {
    double most = 0.0;
    for (int i = 0; i < WP_STATES; i++) {
        const double off = (double)(observer.now[i] - machine.now[i]);
        most = off > most ? off : -off > most ? -off : most;
        if (off != off) {
            return 1e9;
        }
    }
    return most;
}

static void report(const char *name, unsigned taken) {
    printf("%s %u %.9g %d %.6g\n", name, taken, far_off(), (int)wp_observer_healthy(&observer), (double)observer.surprise);
}

int main(void) {
    volatile double huge = 1e308;
    const wp_real infinite = (wp_real)(huge * 10.0);
    const wp_real none = infinite - infinite;
    wp_real state[WP_STATES] = {WP_R(0.0)};

    begin();
    report("plain", run(2000, -1, WP_R(0.0), WP_R(0.0), 0, 1));
    for (int y = 0; y < WP_OUTPUTS; y++) {
        report("infinite", run(1, y, infinite, WP_R(0.0), 1, 0));
        report("minus", run(1, y, -infinite, WP_R(0.0), 1, 0));
        report("nan", run(1, y, none, WP_R(0.0), 1, 0));
        report("glitch", run(1, y, WP_R(3.0), WP_R(0.0), 1, 0));
        report("after", run(50, -1, WP_R(0.0), WP_R(0.0), 0, 0));
    }
    report("command", run(1, -1, WP_R(0.0), infinite, 1, 0));
    report("command", run(1, -1, WP_R(0.0), none, 1, 0));
    report("after", run(50, -1, WP_R(0.0), WP_R(0.0), 0, 0));

    observer.now[0] += WP_R(1.0); /* the filter is wrong itself, and the sensors are right */
    observer.now[1] += WP_R(1.0);
    report("lost", run(1, -1, WP_R(0.0), WP_R(0.0), 0, 0));
    report("doubts", run(15, -1, WP_R(0.0), WP_R(0.0), 0, 0));
    report("found", run(200, -1, WP_R(0.0), WP_R(0.0), 0, 0));
    run(3000, -1, WP_R(0.0), WP_R(0.0), 0, 0);
    report("later", 0);

    observer.now[0] = none;
    report("sick", 0);
    state[0] = none;
    state[1] = infinite;
    wp_observer_start(&observer, state, none);
    report("anew", run(50, -1, WP_R(0.0), WP_R(0.0), 0, 0));

    machine.max_step = observer.max_step = identifier.max_step = WP_R(0.0);
    run(3, -1, WP_R(0.0), WP_R(0.0), 0, 1);
    machine.max_step = observer.max_step = identifier.max_step = WP_R(1e-30);
    run(3, -1, WP_R(0.0), WP_R(0.0), 0, 1);
    machine.max_step = observer.max_step = identifier.max_step = none;
    run(3, -1, WP_R(0.0), WP_R(0.0), 0, 1);
    report("steps", run(50, -1, WP_R(0.0), WP_R(0.0), 0, 1));
    machine.period = observer.period = infinite;
    report("period", run(3, -1, WP_R(0.0), WP_R(0.0), 0, 0));
    memset(&machine, 0, sizeof machine);
    memset(&observer, 0, sizeof observer);
    report("zeros", (unsigned)wp_observer_update(&observer, output));
    wp_observer_predict(&observer, WP_R(1.0));
    wp_machine_step(&machine, WP_R(1.0), output);

    begin();
    printf("compensate");
    const wp_real wanted[] = {infinite, -infinite, none, WP_R(1e8), -WP_R(1e8), WP_R(3e38), WP_R(0.0), WP_R(2.0)};
    for (int i = 0; i < 8; i++) {
        printf(" %.9g", (double)wp_compensate(wanted[i], machine.now));
    }
    machine.now[2] = none;
    printf(" %.9g\n", (double)wp_compensate(WP_R(1.0), machine.now));

    begin();
    machine.period = WP_R(0.001);
    machine.time = WP_R(131072.0);
    for (int k = 0; k < 64000; k++) {
        wp_machine_step(&machine, WP_R(168.0) * machine.now[1] + WP_R(18.0) * machine.now[3], output);
    }
    printf("time %.9g\n", (double)machine.time);
    return 0;
}
