/* An FMU of FMI 3.0 in both kinds, through all that changes its memory; prints its states at the end. */
#include "fmi3.c"

#include <stdio.h>

static void logged(fmi3InstanceEnvironment environment, fmi3Status status, fmi3String category, fmi3String message) {
    (void)environment, (void)status, (void)category;
    fputs(message, stderr);
}

static fmi3Instance begun(fmi3Instance c) {
    const fmi3ValueReference pitch = WP_FIRST_STATE + 1;
    const double angle = 0.05;
    FMI3(EnterInitializationMode)(c, false, 0.0, 0.0, false, 0.0);
    FMI3(SetFloat64)(c, &pitch, 1, &angle, 1);
    FMI3(ExitInitializationMode)(c);
    return c;
}

/* Calls that make no sense, each of which must be refused; returns how many were not. */
static int accepted(fmi3Instance steps, fmi3Instance solved) {
    const fmi3ValueReference input = WP_FIRST_INPUT;
    const double nothing = NAN;
    double value = 0.0;
    bool flag;
    int done = 0;
    done += FMI3(InstantiateCoSimulation)("", WP_TOKEN, "", 0, 0, true, 0, NULL, 0, NULL, NULL, NULL) != NULL;
    done += FMI3(InstantiateModelExchange)("", "another", "", 0, 0, NULL, logged) != NULL;
    done += FMI3(InstantiateScheduledExecution)("", WP_TOKEN, "", 0, 0, NULL, NULL, NULL, NULL, NULL) != NULL;
    done += FMI3(GetFloat64)(NULL, &input, 1, &value, 1) == fmi3OK;
    done += FMI3(GetFloat64)(steps, &input, 1, &value, 2) == fmi3OK;
    done += FMI3(SetFloat64)(steps, &input, 1, NULL, 1) == fmi3OK;
    done += FMI3(SetFloat64)(steps, &input, 1, &nothing, 1) == fmi3OK;
    done += FMI3(DoStep)(steps, 0.0, 1e-3, true, NULL, NULL, NULL, NULL) == fmi3OK;
    done += FMI3(DoStep)(solved, 0.0, 1e-3, true, &flag, &flag, &flag, &value) == fmi3OK;
    done += FMI3(UpdateDiscreteStates)(solved, NULL, &flag, &flag, &flag, &flag, &value) == fmi3OK;
    done += FMI3(UpdateDiscreteStates)(NULL, &flag, &flag, &flag, &flag, &flag, &value) == fmi3OK;
    done += FMI3(EnterInitializationMode)(steps, false, 0.0, 0.0, false, 0.0) == fmi3OK;
    done += FMI3(EnterEventMode)(steps) == fmi3OK;
    done += FMI3(SetTime)(steps, 0.0) == fmi3OK;
    done += FMI3(GetNumberOfContinuousStates)(solved, NULL) == fmi3OK;
    done += FMI3(GetContinuousStateDerivatives)(NULL, &value, WP_ALL_STATES) == fmi3OK;
    done += FMI3(SetInt32)(steps, &input, 1, NULL, 1) == fmi3OK;
    done += FMI3(GetClock)(steps, &input, 1, &flag) == fmi3OK;
    FMI3(FreeInstance)(NULL);
    return done;
}

int main(void) {
    fmi3Instance steps = begun(
        FMI3(InstantiateCoSimulation)("one", WP_TOKEN, "", 0, 0, false, false, NULL, 0, NULL, logged, NULL));
    fmi3Instance solved = begun(FMI3(InstantiateModelExchange)("one", WP_TOKEN, "", 0, 0, NULL, logged));
    double x[WP_ALL_STATES], slope[WP_ALL_STATES], reserves[WP_RESERVES], last, event;
    bool again, end, nominals, changed, defined, early;
    static fmi3Byte bytes[WP_BYTES];
    fmi3FMUState saved = NULL, read = NULL;
    int wrong = accepted(steps, solved);
    for (int k = 0; k < 50; k++) {
        wrong += FMI3(DoStep)(steps, WP_PERIOD * k, WP_PERIOD, true, &changed, &end, &early, &last);
        wrong += FMI3(UpdateDiscreteStates)(solved, &again, &end, &nominals, &changed, &defined, &event);
        wrong += FMI3(EnterContinuousTimeMode)(solved) + FMI3(SetTime)(solved, 1e-3 * k);
        wrong += FMI3(GetContinuousStates)(solved, x, WP_ALL_STATES);
        wrong += FMI3(GetContinuousStateDerivatives)(solved, slope, WP_ALL_STATES);
        wrong += FMI3(GetEventIndicators)(solved, reserves, WP_INDICATORS);
        for (int i = 0; i < WP_ALL_STATES; i++) {
            x[i] += 1e-3 * slope[i];
        }
        wrong += FMI3(SetContinuousStates)(solved, x, WP_ALL_STATES) + FMI3(EnterEventMode)(solved);
    }
    wrong += FMI3(GetFMUState)(steps, &saved) + FMI3(SerializeFMUState)(steps, saved, bytes, sizeof bytes);
    wrong += FMI3(DeserializeFMUState)(steps, bytes, sizeof bytes, &read) + FMI3(SetFMUState)(steps, read);
    wrong += FMI3(SetFMUState)(solved, read) == fmi3OK;
    wrong += FMI3(FreeFMUState)(steps, &saved) + FMI3(FreeFMUState)(steps, &read);
    x[0] = NAN;
    wrong += FMI3(SetContinuousStates)(solved, x, WP_ALL_STATES);
    x[0] = of(steps)->machine.now[0];
    for (int i = 0; i < WP_ALL_STATES; i++) {
        of(solved)->machine.now[i] = i == WP_STATES - 1 ? NAN : 0.0;
    }
    wrong += FMI3(GetContinuousStateDerivatives)(solved, slope, WP_ALL_STATES) != fmi3Discard;
    for (int i = 0; i < WP_ALL_STATES; i++) {
        printf("%.17g %.17g\n", of(steps)->machine.now[i], x[i]);
    }
    wrong += FMI3(Terminate)(solved) + FMI3(Reset)(steps);
    FMI3(FreeInstance)(steps);
    FMI3(FreeInstance)(solved);
    return wrong;
}
