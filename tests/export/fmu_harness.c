/* An FMU of FMI 2.0 in both kinds, through all that changes its memory; prints its states at the end. */
#include "fmi2.c"

#include <stdarg.h>
#include <stdio.h>

static void logged(void *environment, fmi2String name, fmi2Status status, fmi2String category, fmi2String message, ...) {
    va_list words;
    (void)environment, (void)name, (void)status, (void)category;
    va_start(words, message);
    vfprintf(stderr, message, words);
    va_end(words);
}

static fmi2Component begun(fmi2Type kind) {
    const fmi2CallbackFunctions callbacks = {logged, calloc, free, NULL, NULL};
    const fmi2ValueReference pitch = WP_FIRST_STATE + 1;
    const double angle = 0.05;
    fmi2Component c = FMI2(Instantiate)("one", kind, WP_TOKEN, NULL, &callbacks, 0, 0);
    FMI2(SetupExperiment)(c, 0, 0.0, 0.0, 0, 0.0);
    FMI2(SetReal)(c, &pitch, 1, &angle);
    FMI2(EnterInitializationMode)(c);
    FMI2(ExitInitializationMode)(c);
    return c;
}

int main(void) {
    fmi2Component steps = begun(fmi2CoSimulation), solved = begun(fmi2ModelExchange);
    fmi2ValueReference all[WP_VARIABLES], known = WP_FIRST_INPUT, unknown = WP_FIRST_SLOPE, beyond = WP_VARIABLES;
    double value[WP_VARIABLES], x[WP_ALL_STATES], slope[WP_ALL_STATES], reserves[WP_RESERVES], seed = 1.0, found;
    fmi2FMUstate saved = NULL, read = NULL;
    fmi2EventInfo info;
    static fmi2Byte bytes[sizeof(wp_instance)];
    int wrong = FMI2(Instantiate)("two", fmi2CoSimulation, "another", NULL, NULL, 0, 0) != NULL;
    for (unsigned i = 0; i < WP_VARIABLES; i++) {
        all[i] = i;
    }
    for (int k = 0; k < 50; k++) {
        const double input = k % 7 - 3.0;
        wrong += FMI2(SetReal)(steps, &known, 1, &input) != fmi2OK;
        wrong += FMI2(DoStep)(steps, WP_PERIOD * k, WP_PERIOD, 1) != fmi2OK;
    }
    wrong += FMI2(GetFMUstate)(steps, &saved) + FMI2(SerializeFMUstate)(steps, saved, bytes, sizeof bytes);
    wrong += FMI2(DeSerializeFMUstate)(steps, bytes, sizeof bytes, &read) + FMI2(SetFMUstate)(steps, read);
    wrong += FMI2(FreeFMUstate)(steps, &saved) + FMI2(FreeFMUstate)(steps, &read);
    wrong += FMI2(GetReal)(steps, all, WP_VARIABLES, value) + FMI2(GetReal)(solved, all, WP_VARIABLES, value);
    wrong += FMI2(GetReal)(steps, &beyond, 1, value) != fmi2Error;
    wrong += FMI2(GetDirectionalDerivative)(solved, &unknown, 1, &known, 1, &seed, &found);
    wrong += FMI2(GetDirectionalDerivative)(solved, &unknown, 1, &beyond, 1, &seed, &found) != fmi2Error;
    for (int k = 0; k < 50; k++) {
        wrong += FMI2(NewDiscreteStates)(solved, &info) + FMI2(EnterContinuousTimeMode)(solved);
        wrong += FMI2(SetTime)(solved, 1e-3 * k) + FMI2(GetContinuousStates)(solved, x, WP_ALL_STATES);
        wrong += FMI2(GetDerivatives)(solved, slope, WP_ALL_STATES);
        wrong += FMI2(GetEventIndicators)(solved, reserves, WP_INDICATORS);
        for (int i = 0; i < WP_ALL_STATES; i++) {
            x[i] += 1e-3 * slope[i];
        }
        wrong += FMI2(SetContinuousStates)(solved, x, WP_ALL_STATES) + FMI2(EnterEventMode)(solved);
    }
    for (int i = 0; i < WP_ALL_STATES; i++) {
        printf("%.17g %.17g\n", of(steps)->machine.now[i], x[i]);
    }
    wrong += FMI2(Reset)(steps) + FMI2(Terminate)(solved);
    FMI2(FreeInstance)(steps);
    FMI2(FreeInstance)(solved);
    return wrong;
}
