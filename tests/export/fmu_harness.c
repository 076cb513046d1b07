/* An FMU of FMI 2.0 in both kinds, through all that changes its memory; prints its states at the end. */
#include "fmi2.c"

#include <stdarg.h>
#include <stdio.h>

static void logged(void *environment, fmi2String name, fmi2Status status, fmi2String category, fmi2String message,
                   ...) {
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

/* Calls that make no sense, each of which must be refused; returns how many were not. */
static int accepted(fmi2Component steps, fmi2Component solved) {
    const fmi2ValueReference input = WP_FIRST_INPUT, delay = WP_FIRST_PARAMETER + WP_DELAY;
    const double number = HUGE_VAL, negative = -0.01;
    double value = 0.0;
    char bytes[8] = {0};
    fmi2FMUstate state = NULL;
    int done = 0;
    done += FMI2(GetReal)(NULL, &input, 1, &value) == fmi2OK;
    done += FMI2(GetReal)(steps, NULL, 1, &value) == fmi2OK;
    done += FMI2(GetReal)(steps, &input, 1, NULL) == fmi2OK;
    done += FMI2(SetReal)(NULL, &input, 1, &number) == fmi2OK;
    done += FMI2(SetReal)(steps, &input, 1, &number) == fmi2OK;
    done += FMI2(SetReal)(steps, &delay, 1, &negative) == fmi2OK;
    done += FMI2(DoStep)(NULL, 0.0, 1.0, 1) == fmi2OK;
    done += FMI2(DoStep)(solved, 0.0, 1.0, 1) == fmi2OK;
    done += FMI2(DoStep)(steps, 0.0, -1.0, 1) == fmi2OK;
    done += FMI2(DoStep)(steps, 0.0, number, 1) == fmi2OK;
    done += FMI2(SetTime)(steps, 0.0) == fmi2OK;
    done += FMI2(SetTime)(NULL, 0.0) == fmi2OK;
    done += FMI2(SetContinuousStates)(steps, &value, WP_ALL_STATES) == fmi2OK;
    done += FMI2(GetDerivatives)(solved, &value, 1) == fmi2OK;
    done += FMI2(GetDerivatives)(solved, NULL, WP_ALL_STATES) == fmi2OK;
    done += FMI2(GetEventIndicators)(NULL, &value, WP_INDICATORS) == fmi2OK;
    done += FMI2(NewDiscreteStates)(solved, NULL) == fmi2OK;
    done += FMI2(NewDiscreteStates)(NULL, NULL) == fmi2OK;
    done += FMI2(EnterInitializationMode)(steps) == fmi2OK;
    done += FMI2(SetupExperiment)(steps, 0, 0.0, 5.0, 0, 0.0) == fmi2OK;
    done += FMI2(Terminate)(NULL) == fmi2OK;
    done += FMI2(Reset)(NULL) == fmi2OK;
    done += FMI2(GetFMUstate)(NULL, &state) == fmi2OK;
    done += FMI2(SetFMUstate)(steps, NULL) == fmi2OK;
    done += FMI2(SerializeFMUstate)(steps, steps, bytes, sizeof bytes) == fmi2OK;
    done += FMI2(DeSerializeFMUstate)(steps, bytes, sizeof bytes, &state) == fmi2OK;
    done += FMI2(GetRealStatus)(NULL, fmi2LastSuccessfulTime, &value) == fmi2OK;
    FMI2(FreeInstance)(NULL);
    return done;
}

/* Steps of any length, with delays of any length. */
static int any_steps(fmi2Component c) {
    const fmi2ValueReference first = WP_FIRST_PARAMETER;
    const fmi2ValueReference places[] = {WP_FIRST_INPUT, first + WP_DELAY, first + WP_SENSOR_DELAY};
    const double lengths[] = {1e-3, 1e-6, 2.5e-3, 1e-9, 0.7e-3, 1e-5}, delays[] = {3.5e-3, 0.0, 1e-7, 0.2, 1e300};
    double time = 0.0, values[3];
    int wrong = 0;
    for (int k = 0; k < 600; k++) {
        values[0] = k % 5 - 2.0;
        values[1] = delays[k / 100 % 5];
        values[2] = delays[k / 70 % 5];
        wrong += FMI2(SetReal)(c, places, 3, values);
        wrong += FMI2(DoStep)(c, time, lengths[k % 6], 1);
        time += lengths[k % 6];
    }
    return wrong;
}

/* A machine that runs away says so, again and again. */
static int run_away(fmi2Component c) {
    const fmi2ValueReference input = WP_FIRST_INPUT;
    const double far = 1e300;
    int refused = 0;
    (void)FMI2(SetReal)(c, &input, 1, &far);
    for (int k = 0; k < 50; k++) {
        refused += FMI2(DoStep)(c, of(c)->time, WP_PERIOD, 1) == fmi2Error;
    }
    return refused < 10;
}

int main(void) {
    fmi2Component steps = begun(fmi2CoSimulation), solved = begun(fmi2ModelExchange);
    fmi2ValueReference all[WP_VARIABLES], known = WP_FIRST_INPUT, unknown = WP_FIRST_SLOPE, beyond = WP_VARIABLES;
    double value[WP_VARIABLES], x[WP_ALL_STATES], slope[WP_ALL_STATES], reserves[WP_RESERVES], seed = 1.0, found;
    fmi2FMUstate saved = NULL, read = NULL;
    fmi2EventInfo info;
    static fmi2Byte bytes[WP_BYTES];
    int wrong = FMI2(Instantiate)("two", fmi2CoSimulation, "another", NULL, NULL, 0, 0) != NULL;
    wrong += accepted(steps, solved);
    fmi2Component changing = begun(fmi2CoSimulation);
    wrong += any_steps(changing) + run_away(changing);
    FMI2(FreeInstance)(changing);
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
    wrong += FMI2(Terminate)(solved) == fmi2OK;
    wrong += FMI2(SetReal)(solved, &known, 1, &seed) == fmi2OK;
    FMI2(FreeInstance)(steps);
    FMI2(FreeInstance)(solved);
    return wrong;
}
