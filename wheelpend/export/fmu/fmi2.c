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

/* fmi2OK where nothing is wrong; else what is wrong goes to the log. */
static fmi2Status said(fmi2Component c, const char *wrong) {
    const wp_component *own = c;
    if (wrong && own->callbacks.logger) {
        own->callbacks.logger(own->callbacks.componentEnvironment, own->name, fmi2Error, "logStatusError", "%s", wrong);
    }
    return wrong ? fmi2Error : fmi2OK;
}

static wp_instance *of(fmi2Component c) {
    return &((wp_component *)c)->instance;
}

/* NULL where the instance is in this phase; else what it must do first. */
static const char *must_be(fmi2Component c, wp_phase phase) {
    static const char *const words[] = {
        "This must be called before the initialisation.", "This must be called during the initialisation.",
        "This must be called in event mode.",             "This must be called in continuous-time mode.",
        "This must be called in co-simulation, after the initialisation.", "This must be called after the end.",
    };
    return of(c)->phase == phase ? NULL : words[phase];
}

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
        (void)said(own, "The guid must be that of modelDescription.xml, " WP_TOKEN ": the files are of different exports.");
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
    if (!isfinite(start)) {
        return said(c, "The start time must be a finite number.");
    }
    wp_instance_set_time(of(c), start);
    return said(c, must_be(c, WP_CREATED));
}

FMI2_EXPORT fmi2Status FMI2(EnterInitializationMode)(fmi2Component c) {
    const char *wrong = must_be(c, WP_CREATED);
    if (!wrong) {
        of(c)->phase = WP_INITIALISING;
    }
    return said(c, wrong);
}

FMI2_EXPORT fmi2Status FMI2(ExitInitializationMode)(fmi2Component c) {
    const char *wrong = must_be(c, WP_INITIALISING);
    if (!wrong) {
        wp_instance_begin(of(c));
    }
    return said(c, wrong);
}

FMI2_EXPORT fmi2Status FMI2(Terminate)(fmi2Component c) {
    of(c)->phase = WP_ENDED;
    return fmi2OK;
}

FMI2_EXPORT fmi2Status FMI2(Reset)(fmi2Component c) {
    wp_instance_reset(of(c), of(c)->steps);
    return fmi2OK;
}

/* Variables */

FMI2_EXPORT fmi2Status FMI2(GetReal)(fmi2Component c, const fmi2ValueReference which[], size_t count, fmi2Real value[]) {
    for (size_t i = 0; i < count; i++) {
        if (!wp_instance_get(of(c), which[i], &value[i])) {
            return said(c, "There is no variable of this number.");
        }
    }
    return fmi2OK;
}

FMI2_EXPORT fmi2Status FMI2(SetReal)(fmi2Component c, const fmi2ValueReference which[], size_t count,
                                     const fmi2Real value[]) {
    const char *wrong = NULL;
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

FMI2_EXPORT fmi2Status FMI2(GetDirectionalDerivative)(fmi2Component c, const fmi2ValueReference unknowns[], size_t count,
                                                      const fmi2ValueReference knowns[], size_t known_count,
                                                      const fmi2Real seed[], fmi2Real found[]) {
    return said(c, wp_instance_derivative(of(c), unknowns, count, knowns, known_count, seed, found));
}

/* Saved states */

FMI2_EXPORT fmi2Status FMI2(GetFMUstate)(fmi2Component c, fmi2FMUstate *state) {
    *state = *state ? *state : malloc(sizeof(wp_instance));
    if (*state) {
        memcpy(*state, of(c), sizeof(wp_instance));
    }
    return said(c, *state ? NULL : "There is no memory left for a state.");
}

FMI2_EXPORT fmi2Status FMI2(SetFMUstate)(fmi2Component c, fmi2FMUstate state) {
    memcpy(of(c), state, sizeof(wp_instance));
    return fmi2OK;
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
    (void)c, (void)state;
    *size = sizeof(wp_instance);
    return fmi2OK;
}

FMI2_EXPORT fmi2Status FMI2(SerializeFMUstate)(fmi2Component c, fmi2FMUstate state, fmi2Byte bytes[], size_t size) {
    if (size < sizeof(wp_instance)) {
        return said(c, "A state needs more bytes than were given for it.");
    }
    memcpy(bytes, state, sizeof(wp_instance));
    return fmi2OK;
}

FMI2_EXPORT fmi2Status FMI2(DeSerializeFMUstate)(fmi2Component c, const fmi2Byte bytes[], size_t size,
                                                 fmi2FMUstate *state) {
    if (size != sizeof(wp_instance)) {
        return said(c, "These bytes are no state of this FMU.");
    }
    *state = malloc(size);
    if (*state) {
        memcpy(*state, bytes, size);
    }
    return said(c, *state ? NULL : "There is no memory left for a state.");
}

/* Model exchange */

FMI2_EXPORT fmi2Status FMI2(EnterEventMode)(fmi2Component c) {
    const char *wrong = of(c)->phase == WP_EVENT ? NULL : must_be(c, WP_CONTINUOUS);
    of(c)->phase = wrong ? of(c)->phase : WP_EVENT;
    return said(c, wrong);
}

FMI2_EXPORT fmi2Status FMI2(NewDiscreteStates)(fmi2Component c, fmi2EventInfo *info) {
    const char *wrong = must_be(c, WP_EVENT);
    memset(info, 0, sizeof *info);
    if (!wrong) {
        info->valuesOfContinuousStatesChanged = wp_instance_settle(of(c));
        info->nextEventTimeDefined = of(c)->until < HUGE_VAL;
        info->nextEventTime = info->nextEventTimeDefined ? of(c)->until : 0.0;
    }
    return said(c, wrong);
}

FMI2_EXPORT fmi2Status FMI2(EnterContinuousTimeMode)(fmi2Component c) {
    const char *wrong = must_be(c, WP_EVENT);
    of(c)->phase = wrong ? of(c)->phase : WP_CONTINUOUS;
    return said(c, wrong);
}

FMI2_EXPORT fmi2Status FMI2(CompletedIntegratorStep)(fmi2Component c, fmi2Boolean never_back, fmi2Boolean *event,
                                                     fmi2Boolean *end) {
    (void)never_back;
    *event = *end = 0;
    return said(c, must_be(c, WP_CONTINUOUS));
}

FMI2_EXPORT fmi2Status FMI2(SetTime)(fmi2Component c, fmi2Real time) {
    if (!isfinite(time)) {
        return said(c, "The time must be a finite number.");
    }
    wp_instance_set_time(of(c), time);
    return fmi2OK;
}

static const char *must_count(size_t count, size_t right) {
    return count == right ? NULL : "The number of states or event indicators is another.";
}

FMI2_EXPORT fmi2Status FMI2(SetContinuousStates)(fmi2Component c, const fmi2Real x[], size_t count) {
    const char *wrong = must_count(count, WP_ALL_STATES);
    if (!wrong) {
        memcpy(of(c)->machine.now, x, count * sizeof *x);
    }
    return said(c, wrong);
}

FMI2_EXPORT fmi2Status FMI2(GetContinuousStates)(fmi2Component c, fmi2Real x[], size_t count) {
    const char *wrong = must_count(count, WP_ALL_STATES);
    if (!wrong) {
        memcpy(x, of(c)->machine.now, count * sizeof *x);
    }
    return said(c, wrong);
}

FMI2_EXPORT fmi2Status FMI2(GetNominalsOfContinuousStates)(fmi2Component c, fmi2Real x[], size_t count) {
    (void)c;
    for (size_t i = 0; i < count; i++) {
        x[i] = 1.0;
    }
    return fmi2OK;
}

FMI2_EXPORT fmi2Status FMI2(GetDerivatives)(fmi2Component c, fmi2Real slope[], size_t count) {
    const char *wrong = must_count(count, WP_ALL_STATES);
    if (!wrong) {
        wp_instance_slopes(of(c), slope);
    }
    for (size_t i = 0; i < count && !wrong; i++) {
        wrong = isfinite(slope[i])
                    ? NULL
                    : "A derivative is no finite number: neither are the states, the input or the parameters.";
    }
    return said(c, wrong);
}

FMI2_EXPORT fmi2Status FMI2(GetEventIndicators)(fmi2Component c, fmi2Real indicators[], size_t count) {
    wp_real reserves[WP_RESERVES];
    const char *wrong = must_count(count, WP_INDICATORS);
    wp_instance_reserves(of(c), reserves);
    if (!wrong) {
        memcpy(indicators, reserves, count * sizeof *indicators);
    }
    return said(c, wrong);
}

/* Co-simulation */

FMI2_EXPORT fmi2Status FMI2(DoStep)(fmi2Component c, fmi2Real from, fmi2Real length, fmi2Boolean never_back) {
    (void)never_back;
    const char *wrong = must_be(c, WP_STEPPING);
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
    *value = of(c)->time;
    return kind == fmi2LastSuccessfulTime ? fmi2OK : fmi2Discard;
}

FMI2_EXPORT fmi2Status FMI2(GetBooleanStatus)(fmi2Component c, const fmi2StatusKind kind, fmi2Boolean *value) {
    *value = of(c)->phase == WP_ENDED;
    return kind == fmi2Terminated ? fmi2OK : fmi2Discard;
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
