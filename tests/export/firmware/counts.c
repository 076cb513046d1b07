/* Instructions of each call, from QEMU with -icount shift=0, where an instruction takes a nanosecond and the timer counts
   40 of them: a line each, its name, the mean and the most over 500 samples of a robot that is kept upright. */
#include "wheelpend_model.h"

#include <stdint.h>
#include <stdio.h>

#define TIMER_CONTROL (*(volatile uint32_t *)0xE000E010u)
#define TIMER_RELOAD (*(volatile uint32_t *)0xE000E014u)
#define TIMER_NOW (*(volatile uint32_t *)0xE000E018u)
#define INSTRUCTIONS_A_TICK 40u
#define SAMPLES 500

enum { MACHINE, OBSERVER_UPDATE, OBSERVER_PREDICT, IDENTIFIER_UPDATE, IDENTIFIER_PREDICT, COMPENSATE, CALLS };

static uint32_t total[CALLS];
static uint32_t most[CALLS];
static uint32_t begun;

static void begin(void) {
    begun = TIMER_NOW;
}

static void end(int call) {
    const uint32_t ticks = (begun - TIMER_NOW) & 0xFFFFFFu; /* it counts down */
    total[call] += ticks;
    most[call] = ticks > most[call] ? ticks : most[call];
}

int main(void) {
    static const char *const names[CALLS] = {"machine_step",      "observer_update",    "observer_predict",
                                             "identifier_update", "identifier_predict", "compensate"};
    static wp_machine machine;
    static wp_observer observer;
    static wp_identifier identifier;
    wp_real state[WP_STATES] = {WP_R(0.0)};
    wp_real output[WP_OUTPUTS];
    state[1] = WP_R(0.02);
    TIMER_RELOAD = 0xFFFFFFu;
    TIMER_NOW = 0;
    TIMER_CONTROL = 5; /* on, by the processor's clock */
    wp_machine_init(&machine);
    wp_observer_init(&observer);
    wp_identifier_init(&identifier);
    wp_machine_start(&machine, state, WP_R(0.0));
    wp_observer_start(&observer, state, WP_R(0.0));
    wp_identifier_start(&identifier, state, WP_R(0.0));
    wp_machine_read(&machine, output);
    for (int sample = 0; sample < SAMPLES; sample++) {
        begin();
        wp_observer_update(&observer, output);
        end(OBSERVER_UPDATE);
        begin();
        wp_identifier_update(&identifier, output);
        end(IDENTIFIER_UPDATE);
        const wp_real wanted = WP_R(110.0) * output[1] + WP_R(10.0) * output[2];
        begin();
        const wp_real command = wp_compensate(wanted, observer.now);
        end(COMPENSATE);
        begin();
        wp_observer_predict(&observer, command);
        end(OBSERVER_PREDICT);
        begin();
        wp_identifier_predict(&identifier, command);
        end(IDENTIFIER_PREDICT);
        begin();
        wp_machine_step(&machine, command, output);
        end(MACHINE);
    }
    for (int call = 0; call < CALLS; call++) {
        printf("%s %lu %lu\n", names[call], (unsigned long)(total[call] * INSTRUCTIONS_A_TICK / SAMPLES),
               (unsigned long)(most[call] * INSTRUCTIONS_A_TICK));
    }
    return 0;
}
