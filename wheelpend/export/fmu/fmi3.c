/* The functions of FMI 3.0, model exchange and co-simulation. */
#include "fmi3.h"
#include "instance.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

typedef struct {
    wp_instance instance;
    fmi3InstanceEnvironment environment;
    fmi3LogMessageCallback log;
} wp_component;

#define FUNCTION FMI3_EXPORT fmi3Status

/* fmi3OK where nothing is wrong; else this status, and what is wrong goes to the log. */
static fmi3Status said_as(fmi3Instance c, fmi3Status status, const char *wrong) {
    const wp_component *own = c;
    if (wrong && own && own->log) {
        own->log(own->environment, status, status == fmi3Discard ? "logStatusDiscard" : "logStatusError", wrong);
    }
    return wrong ? status : fmi3OK;
}

static fmi3Status said(fmi3Instance c, const char *wrong) {
    return said_as(c, fmi3Error, wrong);
}

static wp_instance *of(fmi3Instance c) {
    return c ? &((wp_component *)c)->instance : NULL;
}

/* NULL where the instance is in one of these phases; else what is wrong. */
static const char *must_be(fmi3Instance c, unsigned phases) {
    return wp_instance_must_be(of(c), phases);
}

#define MISSING "An argument is NULL that must not be."

FMI3_EXPORT const char *FMI3(GetVersion)(void) {
    return "3.0";
}

FUNCTION FMI3(SetDebugLogging)(fmi3Instance c, fmi3Boolean on, size_t count, const fmi3String names[]) {
    (void)c, (void)on, (void)count, (void)names; /* only errors are logged, and they always are */
    return fmi3OK;
}

static fmi3Instance created(fmi3String token, fmi3InstanceEnvironment environment, fmi3LogMessageCallback log,
                            bool steps, const char *wrong) {
    wp_component *own = calloc(1, sizeof *own);
    if (!own) {
        return NULL;
    }
    own->environment = environment;
    own->log = log;
    if (!token || strcmp(token, WP_TOKEN) != 0) {
        wrong = "The token must be that of modelDescription.xml, " WP_TOKEN ": the files are of different exports.";
    }
    if (wrong) {
        (void)said(own, wrong);
        free(own);
        return NULL;
    }
    wp_instance_reset(&own->instance, steps);
    return own;
}

FMI3_EXPORT fmi3Instance FMI3(InstantiateModelExchange)(fmi3String name, fmi3String token, fmi3String resources,
                                                        fmi3Boolean visible, fmi3Boolean logging,
                                                        fmi3InstanceEnvironment environment,
                                                        fmi3LogMessageCallback log) {
    (void)name, (void)resources, (void)visible, (void)logging;
    return created(token, environment, log, false, NULL);
}

FMI3_EXPORT fmi3Instance FMI3(InstantiateCoSimulation)(
    fmi3String name, fmi3String token, fmi3String resources, fmi3Boolean visible, fmi3Boolean logging,
    fmi3Boolean events, fmi3Boolean early_return, const fmi3ValueReference required[], size_t count,
    fmi3InstanceEnvironment environment, fmi3LogMessageCallback log, fmi3IntermediateUpdateCallback update) {
    (void)name, (void)resources, (void)visible, (void)logging, (void)early_return, (void)required, (void)update;
    const char *wrong = events  ? "There is no event mode in co-simulation: events are handled within a step."
                        : count ? "There are no intermediate updates."
                                : NULL;
    return created(token, environment, log, true, wrong);
}

FMI3_EXPORT fmi3Instance FMI3(InstantiateScheduledExecution)(
    fmi3String name, fmi3String token, fmi3String resources, fmi3Boolean visible, fmi3Boolean logging,
    fmi3InstanceEnvironment environment, fmi3LogMessageCallback log, fmi3ClockUpdateCallback update,
    fmi3LockPreemptionCallback lock, fmi3UnlockPreemptionCallback unlock) {
    (void)name, (void)resources, (void)visible, (void)logging, (void)update, (void)lock, (void)unlock;
    return created(token, environment, log, true, "There is no scheduled execution.");
}

FMI3_EXPORT void FMI3(FreeInstance)(fmi3Instance c) {
    free(c);
}

FUNCTION FMI3(EnterInitializationMode)(fmi3Instance c, fmi3Boolean has_tolerance, fmi3Float64 tolerance,
                                       fmi3Float64 start, fmi3Boolean has_stop, fmi3Float64 stop) {
    (void)has_tolerance, (void)tolerance, (void)has_stop, (void)stop;
    const char *wrong = must_be(c, WP_IN(WP_CREATED));
    wrong = wrong || isfinite(start) ? wrong : "The start time must be a finite number.";
    if (!wrong) {
        wp_instance_set_time(of(c), start);
        of(c)->phase = WP_INITIALISING;
    }
    return said(c, wrong);
}

FUNCTION FMI3(ExitInitializationMode)(fmi3Instance c) {
    const char *wrong = must_be(c, WP_IN(WP_INITIALISING));
    if (!wrong) {
        wp_instance_begin(of(c));
    }
    return said(c, wrong);
}

FUNCTION FMI3(Terminate)(fmi3Instance c) {
    const char *wrong = must_be(c, WP_IN_SIMULATION);
    if (!wrong) {
        of(c)->phase = WP_ENDED;
    }
    return said(c, wrong);
}

FUNCTION FMI3(Reset)(fmi3Instance c) {
    const char *wrong = must_be(c, WP_IN_ALL);
    if (!wrong) {
        wp_instance_reset(of(c), of(c)->steps);
    }
    return said(c, wrong);
}

/* Variables */

/* NULL where there is an instance, and lists of as many variables as values. */
static const char *lists_are_wrong(fmi3Instance c, const fmi3ValueReference which[], size_t count,
                                   const fmi3Float64 values[], size_t value_count) {
    if (count != value_count) {
        return "There must be as many values as variables: each is one number.";
    }
    return count && (!which || !values) ? MISSING : must_be(c, WP_IN_ALL);
}

FUNCTION FMI3(GetFloat64)(fmi3Instance c, const fmi3ValueReference which[], size_t count, fmi3Float64 values[],
                          size_t value_count) {
    const char *wrong = lists_are_wrong(c, which, count, values, value_count);
    for (size_t i = 0; i < count && !wrong; i++) {
        wrong = wp_instance_get(of(c), which[i], &values[i]) ? NULL : "There is no variable of this number.";
    }
    return said(c, wrong);
}

FUNCTION FMI3(SetFloat64)(fmi3Instance c, const fmi3ValueReference which[], size_t count, const fmi3Float64 values[],
                          size_t value_count) {
    const char *wrong = lists_are_wrong(c, which, count, values, value_count);
    for (size_t i = 0; i < count && !wrong; i++) {
        wrong = wp_instance_set(of(c), which[i], values[i]);
    }
    return said(c, wrong);
}

/* All variables are Float64. */
#define NO_VARIABLES(type)                                                                                         \
    FUNCTION FMI3(Get##type)(fmi3Instance c, const fmi3ValueReference which[], size_t count, fmi3##type values[],  \
                             size_t value_count) {                                                                 \
        (void)which, (void)values, (void)value_count;                                                              \
        return said(c, count ? "All variables are Float64." : NULL);                                               \
    }                                                                                                              \
    FUNCTION FMI3(Set##type)(fmi3Instance c, const fmi3ValueReference which[], size_t count,                       \
                             const fmi3##type values[], size_t value_count) {                                      \
        (void)which, (void)values, (void)value_count;                                                              \
        return said(c, count ? "All variables are Float64." : NULL);                                               \
    }

NO_VARIABLES(Float32)
NO_VARIABLES(Int8)
NO_VARIABLES(UInt8)
NO_VARIABLES(Int16)
NO_VARIABLES(UInt16)
NO_VARIABLES(Int32)
NO_VARIABLES(UInt32)
NO_VARIABLES(Int64)
NO_VARIABLES(UInt64)
NO_VARIABLES(Boolean)
NO_VARIABLES(String)

/* What this FMU has not, with its arguments: it refuses in words. */
#define HAS_NO(name, words, ...)           \
    FUNCTION FMI3(name)(__VA_ARGS__) {     \
        return said(c, words);             \
    }

#if defined __GNUC__
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wunused-parameter"
#endif
HAS_NO(GetBinary, "All variables are Float64.", fmi3Instance c, const fmi3ValueReference which[], size_t count,
       size_t sizes[], fmi3Binary values[], size_t value_count)
HAS_NO(SetBinary, "All variables are Float64.", fmi3Instance c, const fmi3ValueReference which[], size_t count,
       const size_t sizes[], const fmi3Binary values[], size_t value_count)
HAS_NO(GetClock, "There are no clocks.", fmi3Instance c, const fmi3ValueReference which[], size_t count,
       fmi3Clock values[])
HAS_NO(SetClock, "There are no clocks.", fmi3Instance c, const fmi3ValueReference which[], size_t count,
       const fmi3Clock values[])
HAS_NO(GetNumberOfVariableDependencies, "Dependencies stand in modelDescription.xml.", fmi3Instance c,
       fmi3ValueReference which, size_t *count)
HAS_NO(GetVariableDependencies, "Dependencies stand in modelDescription.xml.", fmi3Instance c, fmi3ValueReference which,
       size_t elements[], fmi3ValueReference independents[], size_t their_elements[], fmi3DependencyKind kinds[],
       size_t count)
HAS_NO(GetAdjointDerivative, "There are directional derivatives and no adjoint ones.", fmi3Instance c,
       const fmi3ValueReference unknowns[], size_t count, const fmi3ValueReference knowns[], size_t known_count,
       const fmi3Float64 seed[], size_t seed_count, fmi3Float64 found[], size_t found_count)
HAS_NO(EnterConfigurationMode, "There are no structural parameters.", fmi3Instance c)
HAS_NO(ExitConfigurationMode, "There are no structural parameters.", fmi3Instance c)
HAS_NO(GetIntervalDecimal, "There are no clocks.", fmi3Instance c, const fmi3ValueReference which[], size_t count,
       fmi3Float64 intervals[], fmi3IntervalQualifier qualifiers[])
HAS_NO(GetIntervalFraction, "There are no clocks.", fmi3Instance c, const fmi3ValueReference which[], size_t count,
       fmi3UInt64 counters[], fmi3UInt64 resolutions[], fmi3IntervalQualifier qualifiers[])
HAS_NO(GetShiftDecimal, "There are no clocks.", fmi3Instance c, const fmi3ValueReference which[], size_t count,
       fmi3Float64 shifts[])
HAS_NO(GetShiftFraction, "There are no clocks.", fmi3Instance c, const fmi3ValueReference which[], size_t count,
       fmi3UInt64 counters[], fmi3UInt64 resolutions[])
HAS_NO(SetIntervalDecimal, "There are no clocks.", fmi3Instance c, const fmi3ValueReference which[], size_t count,
       const fmi3Float64 intervals[])
HAS_NO(SetIntervalFraction, "There are no clocks.", fmi3Instance c, const fmi3ValueReference which[], size_t count,
       const fmi3UInt64 counters[], const fmi3UInt64 resolutions[])
HAS_NO(SetShiftDecimal, "There are no clocks.", fmi3Instance c, const fmi3ValueReference which[], size_t count,
       const fmi3Float64 shifts[])
HAS_NO(SetShiftFraction, "There are no clocks.", fmi3Instance c, const fmi3ValueReference which[], size_t count,
       const fmi3UInt64 counters[], const fmi3UInt64 resolutions[])
HAS_NO(GetOutputDerivatives, "Derivatives of outputs in time are not known.", fmi3Instance c,
       const fmi3ValueReference which[], size_t count, const fmi3Int32 orders[], fmi3Float64 values[],
       size_t value_count)
HAS_NO(ActivateModelPartition, "There is no scheduled execution.", fmi3Instance c, fmi3ValueReference which,
       fmi3Float64 time)
HAS_NO(EnterStepMode, "There is no event mode in co-simulation.", fmi3Instance c)
HAS_NO(EvaluateDiscreteStates, NULL, fmi3Instance c)
#if defined __GNUC__
#pragma GCC diagnostic pop
#endif

FUNCTION FMI3(GetDirectionalDerivative)(fmi3Instance c, const fmi3ValueReference unknowns[], size_t count,
                                        const fmi3ValueReference knowns[], size_t known_count, const fmi3Float64 seed[],
                                        size_t seed_count, fmi3Float64 found[], size_t found_count) {
    const char *wrong = lists_are_wrong(c, unknowns, count, found, found_count);
    wrong = wrong ? wrong : lists_are_wrong(c, knowns, known_count, seed, seed_count);
    return said(c, wrong ? wrong : wp_instance_derivative(of(c), unknowns, count, knowns, known_count, seed, found));
}

/* Saved states */

FUNCTION FMI3(GetFMUState)(fmi3Instance c, fmi3FMUState *state) {
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

FUNCTION FMI3(SetFMUState)(fmi3Instance c, fmi3FMUState state) {
    const char *wrong = state ? must_be(c, WP_IN_ALL) : MISSING;
    if (!wrong && ((const wp_instance *)state)->steps != of(c)->steps) {
        wrong = "A state must be of an instance of the same kind, model exchange or co-simulation.";
    }
    if (!wrong) {
        memcpy(of(c), state, sizeof(wp_instance));
    }
    return said(c, wrong);
}

FUNCTION FMI3(FreeFMUState)(fmi3Instance c, fmi3FMUState *state) {
    (void)c;
    if (state) {
        free(*state);
        *state = NULL;
    }
    return fmi3OK;
}

FUNCTION FMI3(SerializedFMUStateSize)(fmi3Instance c, fmi3FMUState state, size_t *size) {
    (void)state;
    if (!size) {
        return said(c, MISSING);
    }
    *size = WP_BYTES;
    return fmi3OK;
}

FUNCTION FMI3(SerializeFMUState)(fmi3Instance c, fmi3FMUState state, fmi3Byte bytes[], size_t size) {
    return said(c, wp_instance_pack(state, bytes, size));
}

FUNCTION FMI3(DeserializeFMUState)(fmi3Instance c, const fmi3Byte bytes[], size_t size, fmi3FMUState *state) {
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

FUNCTION FMI3(EnterEventMode)(fmi3Instance c) {
    const char *wrong = must_be(c, WP_IN_EXCHANGE);
    if (!wrong) {
        of(c)->phase = WP_EVENT;
    }
    return said(c, wrong);
}

FUNCTION FMI3(UpdateDiscreteStates)(fmi3Instance c, fmi3Boolean *again, fmi3Boolean *end, fmi3Boolean *nominals_changed,
                                    fmi3Boolean *states_changed, fmi3Boolean *has_event, fmi3Float64 *event) {
    const bool missing = !again || !end || !nominals_changed || !states_changed || !has_event || !event;
    const char *wrong = missing ? MISSING : must_be(c, WP_IN(WP_EVENT));
    if (!wrong) {
        *again = *end = *nominals_changed = false;
        *states_changed = wp_instance_settle(of(c));
        *has_event = of(c)->until < HUGE_VAL;
        *event = *has_event ? of(c)->until : 0.0;
    }
    return said(c, wrong);
}

FUNCTION FMI3(EnterContinuousTimeMode)(fmi3Instance c) {
    const char *wrong = must_be(c, WP_IN(WP_EVENT));
    if (!wrong) {
        of(c)->phase = WP_CONTINUOUS;
    }
    return said(c, wrong);
}

FUNCTION FMI3(CompletedIntegratorStep)(fmi3Instance c, fmi3Boolean never_back, fmi3Boolean *event, fmi3Boolean *end) {
    (void)never_back;
    if (!event || !end) {
        return said(c, MISSING);
    }
    *event = *end = false;
    return said(c, must_be(c, WP_IN(WP_CONTINUOUS)));
}

FUNCTION FMI3(SetTime)(fmi3Instance c, fmi3Float64 time) {
    const char *wrong = must_be(c, WP_IN_EXCHANGE);
    wrong = wrong || isfinite(time) ? wrong : "The time must be a finite number.";
    if (!wrong) {
        wp_instance_set_time(of(c), time);
    }
    return said(c, wrong);
}

/* NULL where the instance is in one of these phases, and there is room for the right number of values. */
static const char *must_count(fmi3Instance c, unsigned phases, const fmi3Float64 values[], size_t count, size_t right) {
    if (count != right) {
        return "There must be as many values as states or event indicators.";
    }
    return count && !values ? MISSING : must_be(c, phases);
}

#define KNOWN (WP_IN(WP_INITIALISING) | WP_IN_EXCHANGE | WP_IN(WP_ENDED)) /* phases in which these have values */

/* Numbers as they were found, if all are finite: a solver may then try a shorter step. */
static fmi3Status finite(fmi3Instance c, const wp_real found[], fmi3Float64 values[], size_t count) {
    for (size_t i = 0; i < count; i++) {
        if (!isfinite(found[i])) {
            return said_as(c, fmi3Discard,
                           "Derivatives and event indicators must be finite, and one is not with these states "
                           "and inputs.");
        }
        values[i] = found[i];
    }
    return fmi3OK;
}

FUNCTION FMI3(SetContinuousStates)(fmi3Instance c, const fmi3Float64 x[], size_t count) {
    const char *wrong = must_count(c, WP_IN_EXCHANGE, x, count, WP_ALL_STATES);
    if (!wrong) {
        memcpy(of(c)->machine.now, x, count * sizeof *x);
    }
    return said(c, wrong);
}

FUNCTION FMI3(GetContinuousStates)(fmi3Instance c, fmi3Float64 x[], size_t count) {
    const char *wrong = must_count(c, KNOWN, x, count, WP_ALL_STATES);
    if (!wrong) {
        memcpy(x, of(c)->machine.now, count * sizeof *x);
    }
    return said(c, wrong);
}

FUNCTION FMI3(GetNominalsOfContinuousStates)(fmi3Instance c, fmi3Float64 x[], size_t count) {
    const char *wrong = must_count(c, KNOWN, x, count, WP_ALL_STATES);
    for (size_t i = 0; i < count && !wrong; i++) {
        x[i] = 1.0;
    }
    return said(c, wrong);
}

FUNCTION FMI3(GetContinuousStateDerivatives)(fmi3Instance c, fmi3Float64 slope[], size_t count) {
    wp_real found[WP_ALL_STATES];
    const char *wrong = must_count(c, KNOWN, slope, count, WP_ALL_STATES);
    if (wrong) {
        return said(c, wrong);
    }
    wp_instance_slopes(of(c), found);
    return finite(c, found, slope, count);
}

FUNCTION FMI3(GetEventIndicators)(fmi3Instance c, fmi3Float64 indicators[], size_t count) {
    wp_real found[WP_RESERVES];
    const char *wrong = must_count(c, KNOWN, indicators, count, WP_INDICATORS);
    if (wrong) {
        return said(c, wrong);
    }
    wp_instance_reserves(of(c), found);
    return finite(c, found, indicators, count);
}

FUNCTION FMI3(GetNumberOfEventIndicators)(fmi3Instance c, size_t *count) {
    if (!count) {
        return said(c, MISSING);
    }
    *count = WP_INDICATORS;
    return fmi3OK;
}

FUNCTION FMI3(GetNumberOfContinuousStates)(fmi3Instance c, size_t *count) {
    if (!count) {
        return said(c, MISSING);
    }
    *count = WP_ALL_STATES;
    return fmi3OK;
}

/* Co-simulation */

FUNCTION FMI3(DoStep)(fmi3Instance c, fmi3Float64 from, fmi3Float64 length, fmi3Boolean never_back, fmi3Boolean *event,
                      fmi3Boolean *end, fmi3Boolean *early, fmi3Float64 *last) {
    (void)never_back;
    const char *wrong = event && end && early && last ? must_be(c, WP_IN(WP_STEPPING)) : MISSING;
    if (!wrong) {
        *event = *end = *early = false;
        wrong = wp_instance_step(of(c), from, length);
        *last = of(c)->time;
    }
    return said(c, wrong);
}
