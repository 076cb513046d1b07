/* All parts of an export in one loop, on commands that stand on standard input; prints every number that they hold. */
#include "wheelpend_model.h"

#include <stdio.h>

static void show(const wp_real *numbers, int count) {
    for (int i = 0; i < count; i++) {
        printf("%.17g\n", (double)numbers[i]);
    }
}

#if WP_INPUTS > 1
#define GIVEN command
#else
#define GIVEN command[0]
#endif

int main(void) {
    static wp_machine machine;
    static wp_observer observer;
    static wp_identifier identifier;
    wp_real state[WP_STATES] = {WP_R(0.0)};
    wp_real output[WP_OUTPUTS], rates[WP_STATES];
    wp_real a[WP_STATES][WP_STATES], b[WP_STATES][WP_INPUTS > 0 ? WP_INPUTS : 1], c[WP_OUTPUTS][WP_STATES];
    wp_real command[WP_INPUTS > 0 ? WP_INPUTS : 1] = {WP_R(0.0)};
    double number;
    state[0] = WP_R(0.01);
    state[WP_STATES - 1] = WP_R(0.05);
    wp_machine_init(&machine);
    wp_observer_init(&observer);
    wp_identifier_init(&identifier);
    wp_machine_start(&machine, state, GIVEN);
    wp_observer_start(&observer, state, GIVEN);
    wp_identifier_start(&identifier, state, GIVEN);
    wp_machine_read(&machine, output);
    while (scanf("%lf", &number) == 1) {
        for (int i = 0; i < (WP_INPUTS > 0 ? WP_INPUTS : 1); i++) {
            command[i] = (wp_real)number;
        }
        wp_observer_update(&observer, output);
        wp_identifier_update(&identifier, output);
#ifdef COMPENSATES
        command[0] = wp_compensate(command[0], observer.now);
        show(command, 1);
#endif
        wp_machine_rates(&machine, GIVEN, rates);
        show(rates, WP_STATES);
        wp_observer_predict(&observer, GIVEN);
        wp_identifier_predict(&identifier, GIVEN);
        wp_machine_step(&machine, GIVEN, output);
        show(machine.now, WP_ALL_STATES);
        show(output, WP_OUTPUTS);
        show(observer.now, WP_ALL_STATES);
        show(observer.force, WP_SOURCES);
        show(observer.innovation, WP_OUTPUTS);
        for (int i = 0; i < WP_LEARNT; i++) {
            show(&identifier.parameters[wp_learnt[i]], 1);
        }
    }
    wp_machine_linearise(&machine, GIVEN, a, b, c);
    show(&a[0][0], WP_STATES * WP_STATES);
    show(&b[0][0], WP_STATES * (WP_INPUTS > 0 ? WP_INPUTS : 1));
    show(&c[0][0], WP_OUTPUTS * WP_STATES);
    return 0;
}
