/* An export in a loop of 500 samples; prints the bits of what it ends with, for a host and an emulator to compare. */
#include "wheelpend_model.h"

#include <stdint.h>
#include <stdio.h>

static void show(wp_real number) {
    union {
        float number;
        uint32_t bits;
    } shown;
    shown.number = (float)number;
    printf("%08lx\n", (unsigned long)shown.bits);
}

int main(void) {
    static wp_machine machine;
    static wp_identifier identifier;
    wp_real state[WP_STATES] = {WP_R(0.0)};
    wp_real output[WP_OUTPUTS];
    state[1] = WP_R(0.02);
    wp_machine_init(&machine);
    wp_identifier_init(&identifier);
    wp_machine_start(&machine, state, WP_R(0.0));
    wp_identifier_start(&identifier, state, WP_R(0.0));
    wp_machine_read(&machine, output);
    for (int sample = 0; sample < 500; sample++) {
        wp_identifier_update(&identifier, output);
        const wp_real wanted = WP_R(110.0) * output[1] + WP_R(10.0) * output[2];
        const wp_real command = wp_compensate(wanted, identifier.now);
        wp_identifier_predict(&identifier, command);
        wp_machine_step(&machine, command, output);
    }
    for (int i = 0; i < WP_ALL_STATES; i++) {
        show(machine.now[i]);
        show(identifier.now[i]);
    }
    for (int i = 0; i < WP_LEARNT; i++) {
        show(identifier.parameters[wp_learnt[i]]);
    }
    return 0;
}
