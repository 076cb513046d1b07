/* The functions of FMI 2.0, model exchange and co-simulation. */
#include "fmi2.h"
#include "instance.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

typedef struct {
    wp_instance instance;
    fmi2CallbackFunctions callbacks;
    char name[128];
} wp_component;

/* fmi2OK where nothing is wrong; else this status, and what is wrong goes to the log. */
static fmi2Status said_as(fmi2Component c, fmi2Status status, const char *wrong) {
    const wp_component *own = c;
    if (wrong && own && own->callbacks.logger) {
        own->callbacks.logger(own->callbacks.componentEnvironment, own->name, status,
                              status == fmi2Discard ? "logStatusDiscard" : "logStatusError", "%s", wrong);
    }
    return wrong ? status : fmi2OK;
}

static fmi2Status said(fmi2Component c, const char *wrong) {
    return said_as(c, fmi2Error, wrong);
}

static wp_instance *of(fmi2Component c) {
    return c ? &((wp_component *)c)->instance : NULL;
}

/* NULL where the instance is in one of these phases; else what is wrong. */
static const char *must_be(fmi2Component c, unsigned phases) {
    return wp_instance_must_be(of(c), phases);
}

#define MISSING "An argument is NULL that must not be."

FMI2_EXPORT const char *FMI2(GetTypesPlatform)(void) {
    return "default";
}

FMI2_EXPORT const char *FMI2(GetVersion)(void) {
    return "2.0";
}

FMI2_EXPORT fmi2Status FMI2(SetDebugLogging)(fmi2Component c, fmi2Boolean on, size_t count, const fmi2String names[]) {
    (void)c, (void)on, (void)count, (void)names; /* only errors are logged, and they always are */
    return fmi2OK;
}

FMI2_EXPORT fmi2Component FMI2(Instantiate)(fmi2String name, fmi2Type kind, fmi2String token, fmi2String resources,
                                            const fmi2CallbackFunctions *functions, fmi2Boolean visible,
                                            fmi2Boolean logging) {
    (void)resources, (void)visible, (void)logging;
    wp_component *own = calloc(1, sizeof *own);
    if (!own) {
        return NULL;
    }
    if (functions) {
        own->callbacks = *functions;
    }
    strncpy(own->name, name ? name : "", sizeof own->name - 1);
    if (!token || strcmp(token, WP_TOKEN) != 0) {
        (void)said(own, "The guid must be that of modelDescription.xml, " WP_TOKEN
                        ": the files are of different exports.");
        free(own);
        return NULL;
    }
    wp_instance_reset(&own->instance, kind == fmi2CoSimulation);
    return own;
}

FMI2_EXPORT void FMI2(FreeInstance)(fmi2Component c) {
    free(c);
}

FMI2_EXPORT fmi2Status FMI2(SetupExperiment)(fmi2Component c, fmi2Boolean has_tolerance, fmi2Real tolerance,
                                             fmi2Real start, fmi2Boolean has_stop, fmi2Real stop) {
    (void)has_tolerance, (void)tolerance, (void)has_stop, (void)stop;
    const char *wrong = must_be(c, WP_IN(WP_CREATED));
    wrong = wrong || isfinite(start) ? wrong : "The start time must be a finite number.";
    if (!wrong) {
        wp_instance_set_time(of(c), start);
    }
    return said(c, wrong);
}

FMI2_EXPORT fmi2Status FMI2(EnterInitializationMode)(fmi2Component c) {
    const char *wrong = must_be(c, WP_IN(WP_CREATED));
    if (!wrong) {
        of(c)->phase = WP_INITIALISING;
    }
    return said(c, wrong);
}

FMI2_EXPORT fmi2Status FMI2(ExitInitializationMode)(fmi2Component c) {
    const char *wrong = must_be(c, WP_IN(WP_INITIALISING));
    if (!wrong) {
        wp_instance_begin(of(c));
    }
    return said(c, wrong);
}

FMI2_EXPORT fmi2Status FMI2(Terminate)(fmi2Component c) {
    const char *wrong = must_be(c, WP_IN_SIMULATION);
    if (!wrong) {
        of(c)->phase = WP_ENDED;
    }
    return said(c, wrong);
}

FMI2_EXPORT fmi2Status FMI2(Reset)(fmi2Component c) {
    const char *wrong = must_be(c, WP_IN_ALL);
    if (!wrong) {
        wp_instance_reset(of(c), of(c)->steps);
    }
    return said(c, wrong);
}

/* Variables */

/* NULL where there is an instance, and lists of as many variables and values as are counted. */
static const char *lists_are_wrong(fmi2Component c, const fmi2ValueReference which[], size_t count,
                                   const fmi2Real values[]) {
    return count && (!which || !values) ? MISSING : must_be(c, WP_IN_ALL);
}

FMI2_EXPORT fmi2Status FMI2(GetReal)(fmi2Component c, const fmi2ValueReference which[], size_t count,
                                     fmi2Real value[]) {
    const char *wrong = lists_are_wrong(c, which, count, value);
    for (size_t i = 0; i < count && !wrong; i++) {
        wrong = wp_instance_get(of(c), which[i], &value[i]) ? NULL : "There is no variable of this number.";
    }
    return said(c, wrong);
}

FMI2_EXPORT fmi2Status FMI2(SetReal)(fmi2Component c, const fmi2ValueReference which[], size_t count,
                                     const fmi2Real value[]) {
    const char *wrong = lists_are_wrong(c, which, count, value);
    for (size_t i = 0; i < count && !wrong; i++) {
        wrong = wp_instance_set(of(c), which[i], value[i]);
    }
    return said(c, wrong);
}

/* All variables are real. */
#define NO_VARIABLES(name, type)                                                                                  \
    FMI2_EXPORT fmi2Status FMI2(name)(fmi2Component c, const fmi2ValueReference which[], size_t count, type value[]) { \
        (void)which, (void)value;                                                                                 \
        return said(c, count ? "All variables are real." : NULL);                                                \
    }

NO_VARIABLES(GetInteger, fmi2Integer)
NO_VARIABLES(GetBoolean, fmi2Boolean)
NO_VARIABLES(GetString, fmi2String)
NO_VARIABLES(SetInteger, const fmi2Integer)
NO_VARIABLES(SetBoolean, const fmi2Boolean)
NO_VARIABLES(SetString, const fmi2String)

FMI2_EXPORT fmi2Status FMI2(GetDirectionalDerivative)(fmi2Component c, const fmi2ValueReference unknowns[],
                                                      size_t count,
                                                      const fmi2ValueReference knowns[], size_t known_count,
                                                      const fmi2Real seed[], fmi2Real found[]) {
    const char *wrong = lists_are_wrong(c, unknowns, count, found);
    wrong = wrong ? wrong : lists_are_wrong(c, knowns, known_count, seed);
    return said(c, wrong ? wrong : wp_instance_derivative(of(c), unknowns, count, knowns, known_count, seed, found));
}

/* Saved states */

FMI2_EXPORT fmi2Status FMI2(GetFMUstate)(fmi2Component c, fmi2FMUstate *state) {
    const char *wrong = state ? must_be(c, WP_IN_ALL) : MISSING;
    if (!wrong) {
        *state = *state ? *state : malloc(sizeof(wp_instance));
        wrong = *state ? NULL : "There is no memory left for a state.";
    }
    if (!wrong) {
        memcpy(*state, of(c), sizeof(wp_instance));
    }
    return said(c, wrong);
}

FMI2_EXPORT fmi2Status FMI2(SetFMUstate)(fmi2Component c, fmi2FMUstate state) {
    const char *wrong = state ? must_be(c, WP_IN_ALL) : MISSING;
    if (!wrong && ((const wp_instance *)state)->steps != of(c)->steps) {
        wrong = "A state must be of an instance of the same kind, model exchange or co-simulation.";
    }
    if (!wrong) {
        memcpy(of(c), state, sizeof(wp_instance));
    }
    return said(c, wrong);
}

FMI2_EXPORT fmi2Status FMI2(FreeFMUstate)(fmi2Component c, fmi2FMUstate *state) {
    (void)c;
    if (state) {
        free(*state);
        *state = NULL;
    }
    return fmi2OK;
}

FMI2_EXPORT fmi2Status FMI2(SerializedFMUstateSize)(fmi2Component c, fmi2FMUstate state, size_t *size) {
    (void)state;
    if (!size) {
        return said(c, MISSING);
    }
    *size = WP_BYTES;
    return fmi2OK;
}

FMI2_EXPORT fmi2Status FMI2(SerializeFMUstate)(fmi2Component c, fmi2FMUstate state, fmi2Byte bytes[], size_t size) {
    return said(c, wp_instance_pack(state, bytes, size));
}

FMI2_EXPORT fmi2Status FMI2(DeSerializeFMUstate)(fmi2Component c, const fmi2Byte bytes[], size_t size,
                                                 fmi2FMUstate *state) {
    wp_instance *made = state ? malloc(sizeof *made) : NULL;
    const char *wrong = !state ? MISSING : !made ? "There is no memory left for a state." : NULL;
    wrong = wrong ? wrong : wp_instance_unpack(made, bytes, size);
    if (wrong) {
        free(made);
    } else {
        *state = made;
    }
    return said(c, wrong);
}

/* Model exchange */

FMI2_EXPORT fmi2Status FMI2(EnterEventMode)(fmi2Component c) {
    const char *wrong = must_be(c, WP_IN_EXCHANGE);
    if (!wrong) {
        of(c)->phase = WP_EVENT;
    }
    return said(c, wrong);
}

FMI2_EXPORT fmi2Status FMI2(NewDiscreteStates)(fmi2Component c, fmi2EventInfo *info) {
    const char *wrong = info ? must_be(c, WP_IN(WP_EVENT)) : MISSING;
    if (!wrong) {
        memset(info, 0, sizeof *info);
        info->valuesOfContinuousStatesChanged = wp_instance_settle(of(c));
        info->nextEventTimeDefined = of(c)->until < HUGE_VAL;
        info->nextEventTime = info->nextEventTimeDefined ? of(c)->until : 0.0;
    }
    return said(c, wrong);
}

FMI2_EXPORT fmi2Status FMI2(EnterContinuousTimeMode)(fmi2Component c) {
    const char *wrong = must_be(c, WP_IN(WP_EVENT));
    if (!wrong) {
        of(c)->phase = WP_CONTINUOUS;
    }
    return said(c, wrong);
}

FMI2_EXPORT fmi2Status FMI2(CompletedIntegratorStep)(fmi2Component c, fmi2Boolean never_back, fmi2Boolean *event,
                                                     fmi2Boolean *end) {
    (void)never_back;
    if (!event || !end) {
        return said(c, MISSING);
    }
    *event = *end = 0;
    return said(c, must_be(c, WP_IN(WP_CONTINUOUS)));
}

FMI2_EXPORT fmi2Status FMI2(SetTime)(fmi2Component c, fmi2Real time) {
    const char *wrong = must_be(c, WP_IN_EXCHANGE);
    wrong = wrong || isfinite(time) ? wrong : "The time must be a finite number.";
    if (!wrong) {
        wp_instance_set_time(of(c), time);
    }
    return said(c, wrong);
}

/* NULL where the instance is in one of these phases, and there is room for the right number of values. */
static const char *must_count(fmi2Component c, unsigned phases, const fmi2Real values[], size_t count, size_t right) {
    if (count != right) {
        return "There must be as many values as states or event indicators.";
    }
    return count && !values ? MISSING : must_be(c, phases);
}

#define KNOWN (WP_IN(WP_INITIALISING) | WP_IN_EXCHANGE | WP_IN(WP_ENDED)) /* phases in which these have values */

/* Numbers as they were found, if all are finite: a solver may then try a shorter step. */
static fmi2Status finite(fmi2Component c, const wp_real found[], fmi2Real values[], size_t count) {
    for (size_t i = 0; i < count; i++) {
        if (!isfinite(found[i])) {
            return said_as(c, fmi2Discard,
                           "Derivatives and event indicators must be finite, and one is not with these states "
                           "and inputs.");
        }
        values[i] = found[i];
    }
    return fmi2OK;
}

FMI2_EXPORT fmi2Status FMI2(SetContinuousStates)(fmi2Component c, const fmi2Real x[], size_t count) {
    const char *wrong = must_count(c, WP_IN_EXCHANGE, x, count, WP_ALL_STATES);
    if (!wrong) {
        memcpy(of(c)->machine.now, x, count * sizeof *x);
    }
    return said(c, wrong);
}

FMI2_EXPORT fmi2Status FMI2(GetContinuousStates)(fmi2Component c, fmi2Real x[], size_t count) {
    const char *wrong = must_count(c, KNOWN, x, count, WP_ALL_STATES);
    if (!wrong) {
        memcpy(x, of(c)->machine.now, count * sizeof *x);
    }
    return said(c, wrong);
}

FMI2_EXPORT fmi2Status FMI2(GetNominalsOfContinuousStates)(fmi2Component c, fmi2Real x[], size_t count) {
    const char *wrong = must_count(c, KNOWN, x, count, WP_ALL_STATES);
    for (size_t i = 0; i < count && !wrong; i++) {
        x[i] = 1.0;
    }
    return said(c, wrong);
}

FMI2_EXPORT fmi2Status FMI2(GetDerivatives)(fmi2Component c, fmi2Real slope[], size_t count) {
    wp_real found[WP_ALL_STATES];
    const char *wrong = must_count(c, KNOWN, slope, count, WP_ALL_STATES);
    if (wrong) {
        return said(c, wrong);
    }
    wp_instance_slopes(of(c), found);
    return finite(c, found, slope, count);
}

FMI2_EXPORT fmi2Status FMI2(GetEventIndicators)(fmi2Component c, fmi2Real indicators[], size_t count) {
    wp_real found[WP_RESERVES];
    const char *wrong = must_count(c, KNOWN, indicators, count, WP_INDICATORS);
    if (wrong) {
        return said(c, wrong);
    }
    wp_instance_reserves(of(c), found);
    return finite(c, found, indicators, count);
}

/* Co-simulation */

FMI2_EXPORT fmi2Status FMI2(DoStep)(fmi2Component c, fmi2Real from, fmi2Real length, fmi2Boolean never_back) {
    (void)never_back;
    const char *wrong = must_be(c, WP_IN(WP_STEPPING));
    return said(c, wrong ? wrong : wp_instance_step(of(c), from, length));
}

FMI2_EXPORT fmi2Status FMI2(CancelStep)(fmi2Component c) {
    return said(c, "A step is done when fmi2DoStep returns: there is none to cancel.");
}

FMI2_EXPORT fmi2Status FMI2(SetRealInputDerivatives)(fmi2Component c, const fmi2ValueReference which[], size_t count,
                                                     const fmi2Integer order[], const fmi2Real value[]) {
    (void)which, (void)order, (void)value;
    return said(c, count ? "An input is held over a step, and has no derivatives." : NULL);
}

FMI2_EXPORT fmi2Status FMI2(GetRealOutputDerivatives)(fmi2Component c, const fmi2ValueReference which[], size_t count,
                                                      const fmi2Integer order[], fmi2Real value[]) {
    (void)which, (void)order, (void)value;
    return said(c, count ? "Derivatives of outputs in time are not known." : NULL);
}

FMI2_EXPORT fmi2Status FMI2(GetRealStatus)(fmi2Component c, const fmi2StatusKind kind, fmi2Real *value) {
    const char *wrong = value ? must_be(c, WP_IN_ALL) : MISSING;
    if (wrong || kind != fmi2LastSuccessfulTime) {
        return wrong ? said(c, wrong) : fmi2Discard;
    }
    *value = of(c)->time;
    return fmi2OK;
}

FMI2_EXPORT fmi2Status FMI2(GetBooleanStatus)(fmi2Component c, const fmi2StatusKind kind, fmi2Boolean *value) {
    const char *wrong = value ? must_be(c, WP_IN_ALL) : MISSING;
    if (wrong || kind != fmi2Terminated) {
        return wrong ? said(c, wrong) : fmi2Discard;
    }
    *value = 0; /* it never ends a simulation by itself */
    return fmi2OK;
}

/* Of a step that is never left pending there is nothing else to tell. */
#define NO_STATUS(name, type)                                                                      \
    FMI2_EXPORT fmi2Status FMI2(name)(fmi2Component c, const fmi2StatusKind kind, type *value) {   \
        (void)c, (void)kind, (void)value;                                                          \
        return fmi2Discard;                                                                        \
    }

NO_STATUS(GetStatus, fmi2Status)
NO_STATUS(GetIntegerStatus, fmi2Integer)
NO_STATUS(GetStringStatus, fmi2String)
