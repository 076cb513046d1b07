/* An instance of the model as FMI knows it. */
#include "instance.h"

#include <math.h>
#include <string.h>

#if WP_INPUTS > 1
#define WP_GIVEN(values) (values)
#else
#define WP_GIVEN(values) (values)[0]
#endif

#define WP_AT_EVENT 1e-9 /* s, within which a moment is that of an event */
#define WP_SHARE 1e-3    /* of a variable, by which differences move it */
#define WP_SAME_TIME 1e-6 /* of a step, within which two moments are one */
#define WP_UNKNOWN_MODE 2.0

const char *wp_instance_must_be(const wp_instance *instance, unsigned phases) {
    if (!instance) {
        return "An instance must be given, and NULL is none.";
    }
    if (phases & WP_IN(instance->phase)) {
        return NULL;
    }
    switch (phases) {
    case WP_IN(WP_CREATED): return "This must be called before the initialisation, once instantiated or reset.";
    case WP_IN(WP_INITIALISING): return "This must be called during the initialisation.";
    case WP_IN(WP_EVENT): return "This must be called in model exchange, in event mode.";
    case WP_IN(WP_CONTINUOUS): return "This must be called in model exchange, in continuous-time mode.";
    case WP_IN(WP_STEPPING): return "This must be called in co-simulation, after the initialisation.";
    case WP_IN_EXCHANGE: return "This must be called in model exchange, after the initialisation.";
    case WP_IN_SIMULATION: return "This must be called between the initialisation and the end.";
    default: return "This must be called in another state of the instance.";
    }
}

void wp_instance_reset(wp_instance *instance, bool steps) {
    memset(instance, 0, sizeof *instance);
    wp_machine_init(&instance->machine);
    instance->largest_step = instance->machine.max_step;
    instance->steps = steps;
    instance->phase = WP_CREATED;
    instance->since = -HUGE_VAL;
    instance->until = HUGE_VAL;
    for (int i = 0; i < WP_SURFACES; i++) {
        instance->directions[i] = WP_UNKNOWN_MODE;
    }
}

/* The last place whose time is not above this one [s], counted back from the newest; count where all are above. */
static int place_at(const double when[], int kept, int newest, int count, double time) {
    int back = 0;
    while (back < count && when[(newest - back + kept) % kept] > time) {
        back++;
    }
    return back;
}

/* The command that was given at a time [s]. */
static const wp_real *command_at(const wp_past_commands *past, double time) {
    const int back = place_at(past->when, WP_KEPT_COMMANDS, past->newest, past->count, time);
    const int held = back < past->count ? back : past->count - 1; /* before all of them the oldest */
    return past->command[(past->newest - held + WP_KEPT_COMMANDS) % WP_KEPT_COMMANDS];
}

/* Keep a command that is given from this time on [s]; of two that follow each other closely the later one. */
static void keep_command(wp_past_commands *past, double when, const wp_real command[WP_DRIVEN], double closest) {
    if (past->count > 0 && memcmp(past->command[past->newest], command, sizeof past->command[0]) == 0) {
        return;
    }
    if (past->count == 0 || when - past->when[past->newest] >= closest) {
        past->newest = past->count > 0 ? (past->newest + 1) % WP_KEPT_COMMANDS : 0;
        past->count += past->count < WP_KEPT_COMMANDS;
        past->when[past->newest] = when;
    }
    memcpy(past->command[past->newest], command, sizeof past->command[0]);
}

/* Keep readings of this time [s], unless they follow the last ones closely. */
static void keep_readings(wp_past_readings *past, double when, const wp_real reading[WP_OUTPUTS], double closest) {
    if (past->count == 0 || when - past->when[past->newest] >= closest) {
        past->newest = past->count > 0 ? (past->newest + 1) % WP_KEPT_READINGS : 0;
        past->count += past->count < WP_KEPT_READINGS;
        past->when[past->newest] = when;
        memcpy(past->reading[past->newest], reading, sizeof past->reading[0]);
    }
}

/* A sensor's reading at a time [s], on a straight line between those that are kept. */
static wp_real reading_at(const wp_past_readings *past, int output, double time, double tolerance) {
    const int back = place_at(past->when, WP_KEPT_READINGS, past->newest, past->count, time + tolerance);
    const int held = back < past->count ? back : past->count - 1;
    const int before = (past->newest - held + WP_KEPT_READINGS) % WP_KEPT_READINGS;
    const int after = (before + 1) % WP_KEPT_READINGS;
    const double passed = time - past->when[before];
    if (back == 0 || back >= past->count || passed <= tolerance) {
        return past->reading[before][output];
    }
    return past->reading[before][output] + (past->reading[after][output] - past->reading[before][output]) * passed /
                                               (past->when[after] - past->when[before]);
}

/* A delay among the parameters [s], 0 where there is none. */
static double delay_of(const wp_instance *instance, int place) {
    return place >= 0 ? instance->machine.parameters[place] : 0.0;
}

/* The input that the machine gets now: in co-simulation behind its delay. */
static const wp_real *given_input(const wp_instance *instance) {
    const double delay = delay_of(instance, WP_DELAY);
    const bool late = instance->steps && instance->commands.count > 0 && delay > 0.0;
    return late ? command_at(&instance->commands, instance->time - delay) : instance->input;
}

/* The modes of the surfaces: those that events left, else as the state has them. */
static void modes(const wp_instance *instance, wp_real directions[WP_SURFACES]) {
    memcpy(directions, instance->directions, sizeof instance->directions);
    if (directions[0] >= WP_UNKNOWN_MODE) {
        wp_machine machine = instance->machine;
        wp_machine_settle(&machine, WP_GIVEN(given_input(instance)), directions);
    }
}

void wp_instance_slopes(const wp_instance *instance, wp_real slope[WP_ALL_STATES]) {
    wp_real directions[WP_SURFACES];
    modes(instance, directions);
    wp_machine_slopes(&instance->machine, WP_GIVEN(given_input(instance)), directions, slope);
}

void wp_instance_reserves(const wp_instance *instance, wp_real reserves[WP_RESERVES]) {
    wp_real directions[WP_SURFACES];
    modes(instance, directions);
    wp_machine_reserves(&instance->machine, WP_GIVEN(given_input(instance)), directions, reserves);
}

bool wp_instance_get(const wp_instance *instance, unsigned variable, double *value) {
    const int place = variable < WP_VARIABLES ? (int)variable : WP_VARIABLES;
    wp_real found[WP_ALL_STATES + WP_OUTPUTS + WP_RESERVES] = {0.0};
    if (place == WP_TIME) {
        *value = instance->time;
    } else if (place < WP_FIRST_SLOPE) {
        *value = instance->machine.now[place - WP_FIRST_STATE];
    } else if (place < WP_FIRST_INPUT) {
        wp_instance_slopes(instance, found);
        *value = found[place - WP_FIRST_SLOPE];
    } else if (place < WP_FIRST_OUTPUT) {
        *value = instance->input[place - WP_FIRST_INPUT];
    } else if (place < WP_FIRST_PARAMETER) {
        wp_machine_read(&instance->machine, found);
        const bool stepped = instance->steps && instance->phase >= WP_STEPPING;
        *value = (stepped ? instance->output : found)[place - WP_FIRST_OUTPUT];
    } else if (place < WP_FIRST_COMMAND) {
        *value = instance->machine.parameters[place - WP_FIRST_PARAMETER];
    } else if (place < WP_FIRST_DIRECTION) {
        *value = instance->command[(place - WP_FIRST_COMMAND) / WP_DRIVEN][(place - WP_FIRST_COMMAND) % WP_DRIVEN];
    } else if (place < WP_FIRST_RESERVE) {
        modes(instance, found);
        *value = found[place - WP_FIRST_DIRECTION];
    } else if (place < WP_VARIABLES) {
        wp_instance_reserves(instance, found);
        *value = found[place - WP_FIRST_RESERVE];
    }
    return place < WP_VARIABLES;
}

/* A variable that can be set, or NULL. */
static wp_real *settable(wp_instance *instance, int place) {
    if (place >= WP_FIRST_STATE && place < WP_FIRST_SLOPE) {
        return &instance->machine.now[place - WP_FIRST_STATE];
    }
    if (place >= WP_FIRST_INPUT && place < WP_FIRST_OUTPUT) {
        return &instance->input[place - WP_FIRST_INPUT];
    }
    if (place >= WP_FIRST_PARAMETER && place < WP_FIRST_COMMAND) {
        return &instance->machine.parameters[place - WP_FIRST_PARAMETER];
    }
    if (place >= WP_FIRST_COMMAND && place < WP_FIRST_DIRECTION) {
        return &instance->command[(place - WP_FIRST_COMMAND) / WP_DRIVEN][(place - WP_FIRST_COMMAND) % WP_DRIVEN];
    }
    return NULL;
}

const char *wp_instance_set(wp_instance *instance, unsigned variable, double value) {
    const int place = variable < WP_VARIABLES ? (int)variable : WP_VARIABLES;
    wp_real *target = settable(instance, place);
    const bool is_input = place >= WP_FIRST_INPUT && place < WP_FIRST_OUTPUT;
    const bool is_parameter = place >= WP_FIRST_PARAMETER && place < WP_FIRST_COMMAND;
    const bool is_delay = is_parameter && (place - WP_FIRST_PARAMETER == WP_DELAY ||
                                           place - WP_FIRST_PARAMETER == WP_SENSOR_DELAY);
    if (!target) {
        return "Only inputs, parameters and start values can be set, and this variable is none of them.";
    }
    if (!isfinite(value)) {
        return "A value must be a finite number, and the one that came is none.";
    }
    if (!is_input && !is_parameter && instance->phase > WP_INITIALISING) {
        return "A start value can be set before the initialisation ends, and no later.";
    }
    if (is_parameter && instance->phase == WP_CONTINUOUS) {
        return "A parameter can be set before the start, in event mode and between communication steps: "
               "enter event mode.";
    }
    if (instance->phase == WP_ENDED) {
        return "Nothing can be set after the end: reset the instance.";
    }
    if (is_delay && value < 0.0) {
        return "A delay must be 0 or above, and the one that came is negative.";
    }
    *target = value;
    return NULL;
}

/* The time at which the model is evaluated: at an event in time on the side on which the solver is. */
static double moment(const wp_instance *instance) {
    if (instance->time > instance->until - WP_AT_EVENT) {
        return instance->until - WP_AT_EVENT;
    }
    return instance->time < instance->since + WP_AT_EVENT ? instance->since + WP_AT_EVENT : instance->time;
}

void wp_instance_set_time(wp_instance *instance, double time) {
    instance->time = time;
    instance->machine.time = moment(instance);
}

bool wp_instance_settle(wp_instance *instance) {
    static const int events[] = WP_EVENT_TIMES;
    wp_real before[WP_ALL_STATES];
    memcpy(before, instance->machine.now, sizeof before);
    instance->until = HUGE_VAL;
    for (int i = 0; i < WP_EVENTS; i++) {
        const double event = instance->machine.parameters[events[i]];
        if (event > instance->time + WP_AT_EVENT && event < instance->until) {
            instance->until = event;
        } else if (fabs(event - instance->time) <= WP_AT_EVENT) {
            instance->since = event;
        }
    }
    instance->machine.time = moment(instance);
    wp_machine_settle(&instance->machine, WP_GIVEN(instance->input), instance->directions);
    return memcmp(before, instance->machine.now, sizeof before) != 0;
}

void wp_instance_begin(wp_instance *instance) {
    const wp_machine given = instance->machine;
    wp_machine_start(&instance->machine, given.now, WP_GIVEN(instance->command[0]));
    memcpy(instance->machine.now, given.now, sizeof given.now);
    memcpy(instance->machine.parameters, given.parameters, sizeof given.parameters);
    instance->machine.time = instance->time;
    wp_machine_read(&instance->machine, instance->output);
    if (WP_DELAY >= 0) {
        for (int j = WP_COMMANDS; j > 0; j--) {
            keep_command(&instance->commands, instance->time - j * WP_PERIOD, instance->command[j - 1], 0.0);
        }
    }
    if (WP_SENSOR_DELAY >= 0) {
        keep_readings(&instance->readings, instance->time, instance->output, 0.0);
    }
    if (instance->steps) {
        instance->phase = WP_STEPPING;
    } else {
        instance->phase = WP_EVENT;
        (void)wp_instance_settle(instance);
    }
}

/* When the next command begins to act after a time [s]; that of no command is infinite. */
static double next_switch(const wp_past_commands *past, double delay, double time) {
    const int back = place_at(past->when, WP_KEPT_COMMANDS, past->newest, past->count, time - delay);
    return back == 0 ? HUGE_VAL : past->when[(past->newest - back + 1 + WP_KEPT_COMMANDS) % WP_KEPT_COMMANDS] + delay;
}

/* What is left of a delay [s] after whole periods: so long before the end of one a late sensor looks. */
static double rest_of(double delay, double period) {
    const double periods = delay / period + WP_SAME_TIME;
    const double rest = periods < 1e6 ? delay - (int)periods * period : 0.0;
    return rest > 0.0 ? rest : 0.0;
}

/* The machine without delays, under the input of part of a period [s]. */
static void step_part(wp_instance *instance, double length, const wp_real *input) {
    wp_machine *machine = &instance->machine;
    wp_real given[WP_PARAMETERS];
    memcpy(given, machine->parameters, sizeof given);
    machine->period = length;
    machine->max_step = length < instance->largest_step ? length : instance->largest_step;
    for (int i = 0; i < WP_PARAMETERS; i++) {
        machine->parameters[i] = i == WP_DELAY || i == WP_SENSOR_DELAY ? WP_R(0.0) : given[i];
    }
    wp_machine_step(machine, WP_GIVEN(input), instance->output);
    memcpy(machine->parameters, given, sizeof given);
}

/* A period [s] in parts: until another command acts, and until late sensors look. */
static void step_period(wp_instance *instance, double period) {
    static const bool late[WP_OUTPUTS] = WP_LATE;
    const double begin = instance->machine.time, same = WP_SAME_TIME * period;
    const double delay = delay_of(instance, WP_DELAY), age = delay_of(instance, WP_SENSOR_DELAY);
    const double look = period - rest_of(age, period);
    keep_command(&instance->commands, begin, instance->input, delay / (WP_KEPT_COMMANDS - 1));
    for (double passed = 0.0, until = 0.0; passed < period; passed = until) {
        const double change = next_switch(&instance->commands, delay, begin + passed + same) - begin;
        until = passed < look ? look : period;
        until = change > passed && change < until - same ? change : until;
        step_part(instance, until - passed, command_at(&instance->commands, begin + passed + same - delay));
        if (WP_SENSOR_DELAY >= 0 && until == look) {
            keep_readings(&instance->readings, begin + look, instance->output, age / (WP_KEPT_READINGS - 1));
        }
    }
    for (int i = 0; i < WP_OUTPUTS; i++) {
        if (late[i]) {
            instance->output[i] = reading_at(&instance->readings, i, begin + period - age, same);
        }
    }
}

const char *wp_instance_step(wp_instance *instance, double from, double length) {
    const double parts = length / WP_PERIOD + 0.5;
    wp_machine *machine = &instance->machine;
    if (!(length > 0.0) || !(parts < 1e9)) {
        return "A communication step must be above zero and below a thousand million of the model's periods.";
    }
    if (!(fabs(from - instance->time) <= 1e-6 * (1.0 + fabs(from)))) {
        return "A step must begin where the last one ended.";
    }
    const int count = parts < 1.0 ? 1 : (int)parts;
    for (int i = 0; i < count; i++) {
        machine->time = from + i * (length / count);
        machine->carried = 0.0;
        step_period(instance, length / count);
    }
    instance->time = machine->time = from + length;
    for (int i = 0; i < WP_ALL_STATES; i++) {
        if (!isfinite(machine->now[i])) {
            return "The state is no finite number any more: the machine has run away.";
        }
    }
    return NULL;
}

const char *wp_instance_pack(const wp_instance *saved, void *bytes, size_t size) {
    if (!saved || !bytes || size < WP_BYTES) {
        return "A saved state and room for all of its bytes must be given.";
    }
    memcpy(bytes, WP_TOKEN, sizeof WP_TOKEN);
    memcpy((char *)bytes + sizeof WP_TOKEN, saved, sizeof *saved);
    return NULL;
}

const char *wp_instance_unpack(wp_instance *saved, const void *bytes, size_t size) {
    if (!bytes || size != WP_BYTES || memcmp(bytes, WP_TOKEN, sizeof WP_TOKEN) != 0) {
        return "A saved state must be one of this FMU, and these bytes are none.";
    }
    memcpy(saved, (const char *)bytes + sizeof WP_TOKEN, sizeof *saved);
    return NULL;
}

const char *wp_instance_derivative(const wp_instance *instance, const unsigned unknowns[], size_t count,
                                   const unsigned knowns[], size_t known_count, const double seed[], double found[]) {
    static const double weights[] = {1.0, -8.0, 8.0, -1.0}, offsets[] = {-2.0, -1.0, 1.0, 2.0};
    wp_instance held = *instance;
    double share = 0.0, value = 0.0;
    modes(instance, held.directions);
    held.phase = WP_EVENT; /* outputs of the states as they are moved, not of the last step */
    for (size_t u = 0; u < count; u++) {
        found[u] = 0.0;
    }
    for (size_t k = 0; k < known_count; k++) {
        const bool is_parameter = knowns[k] >= (unsigned)WP_FIRST_PARAMETER && knowns[k] < (unsigned)WP_FIRST_COMMAND;
        if (knowns[k] >= (unsigned)WP_VARIABLES || !settable(&held, (int)knowns[k])) {
            return "A derivative is known along states, inputs and parameters, and this variable is none of them.";
        }
        (void)wp_instance_get(instance, knowns[k], &value);
        const double own = fabs(seed[k]) / (is_parameter && value != 0.0 ? fabs(value) : 1.0);
        if (!isfinite(own)) {
            return "A seed must be a finite number, and the one that came is none.";
        }
        share = own > share ? own : share;
    }
    if (share == 0.0) {
        return NULL;
    }
    for (int point = 0; point < 4; point++) {
        wp_instance moved = held;
        for (size_t k = 0; k < known_count; k++) {
            *settable(&moved, (int)knowns[k]) += offsets[point] * WP_SHARE / share * seed[k];
        }
        for (size_t u = 0; u < count; u++) {
            if (!wp_instance_get(&moved, unknowns[u], &value)) {
                return "There is no variable of this number.";
            }
            found[u] += weights[point] * value * share / (12.0 * WP_SHARE);
        }
    }
    for (size_t u = 0; u < count; u++) {
        if (!isfinite(found[u])) {
            return "A derivative is no finite number: neither are the states, the input or the parameters.";
        }
    }
    return NULL;
}
