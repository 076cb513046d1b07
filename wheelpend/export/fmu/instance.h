/* An instance of the model as FMI knows it, whichever the version: numbered real variables, modes, events, steps. */
#ifndef WHEELPEND_INSTANCE_H
#define WHEELPEND_INSTANCE_H

#include "wheelpend_fmu.h"
#include "wheelpend_model.h"

#include <stdbool.h>
#include <stddef.h>

#ifdef WP_SINGLE
#error "FMI knows double alone: compile without WP_SINGLE"
#endif

#define WP_DRIVEN (WP_INPUTS > 0 ? WP_INPUTS : 1)
#define WP_RESERVES (2 * WP_SURFACES)
#define WP_KEPT_COMMANDS (WP_DELAY >= 0 ? WP_COMMANDS + 256 : 2)
#define WP_KEPT_READINGS (WP_SENSOR_DELAY >= 0 ? WP_LATE_READINGS + 256 : 2)

/* Value references: the first of each kind. */
enum {
    WP_TIME = 0,
    WP_FIRST_STATE = 1,
    WP_FIRST_SLOPE = WP_FIRST_STATE + WP_ALL_STATES,
    WP_FIRST_INPUT = WP_FIRST_SLOPE + WP_ALL_STATES,
    WP_FIRST_OUTPUT = WP_FIRST_INPUT + WP_DRIVEN,
    WP_FIRST_PARAMETER = WP_FIRST_OUTPUT + WP_OUTPUTS,
    WP_FIRST_COMMAND = WP_FIRST_PARAMETER + WP_PARAMETERS,
    WP_FIRST_DIRECTION = WP_FIRST_COMMAND + WP_COMMANDS * WP_DRIVEN,
    WP_FIRST_RESERVE = WP_FIRST_DIRECTION + WP_SURFACES,
    WP_VARIABLES = WP_FIRST_RESERVE + WP_RESERVES
};

/* In model exchange: created, initialising, then event and continuous in turn. In co-simulation: stepping. */
typedef enum { WP_CREATED, WP_INITIALISING, WP_EVENT, WP_CONTINUOUS, WP_STEPPING, WP_ENDED } wp_phase;

/* Sets of them, in which a function may be called. */
#define WP_IN(phase) (1u << (phase))
#define WP_IN_EXCHANGE (WP_IN(WP_EVENT) | WP_IN(WP_CONTINUOUS))
#define WP_IN_SIMULATION (WP_IN_EXCHANGE | WP_IN(WP_STEPPING))
#define WP_IN_ALL (WP_IN(WP_CREATED) | WP_IN(WP_INITIALISING) | WP_IN_SIMULATION | WP_IN(WP_ENDED))

/* Commands and readings of co-simulation at their times, of which the last is at newest and the others before it. */
typedef struct {
    int count, newest;
    double when[WP_KEPT_COMMANDS]; /* s, from which on the command was given */
    wp_real command[WP_KEPT_COMMANDS][WP_DRIVEN];
} wp_past_commands;

typedef struct {
    int count, newest;
    double when[WP_KEPT_READINGS]; /* s */
    wp_real reading[WP_KEPT_READINGS][WP_OUTPUTS];
} wp_past_readings;

/* All that changes: a copy of it is a saved state. */
typedef struct {
    wp_machine machine;
    wp_real input[WP_DRIVEN];
    wp_real output[WP_OUTPUTS];               /* in co-simulation, of the last step */
    wp_real directions[WP_SURFACES];          /* in model exchange, of each surface with dry friction */
    wp_real command[WP_COMMANDS][WP_DRIVEN];  /* before the start, the newest first */
    wp_past_commands commands;                /* in co-simulation, where the input is delayed */
    wp_past_readings readings;                /* in co-simulation, where sensors are late */
    wp_real largest_step;                     /* s, of the integrator */
    double time, since, until;                /* s: now, the last and the next event in time */
    wp_phase phase;
    bool steps; /* true in co-simulation */
} wp_instance;

/* NULL where the instance is in one of these phases; this and most others below return else what is wrong. */
const char *wp_instance_must_be(const wp_instance *instance, unsigned phases);

/* As it was created. */
void wp_instance_reset(wp_instance *instance, bool steps);

/* The value of a variable; false where there is none of this number. */
bool wp_instance_get(const wp_instance *instance, unsigned variable, double *value);

/* Set a variable. */
const char *wp_instance_set(wp_instance *instance, unsigned variable, double value);

/* The end of initialisation. */
void wp_instance_begin(wp_instance *instance);

/* A point in time of model exchange. */
void wp_instance_set_time(wp_instance *instance, double time);

/* Modes at an event; true where it changed states: what came to rest has no speed any more. */
bool wp_instance_settle(wp_instance *instance);

void wp_instance_slopes(const wp_instance *instance, wp_real slope[WP_ALL_STATES]);
void wp_instance_reserves(const wp_instance *instance, wp_real reserves[WP_RESERVES]);

/* A communication step of any length, in the whole number of equal parts that are nearest to the model's periods. */
const char *wp_instance_step(wp_instance *instance, double from, double length);

/* A saved state as bytes, WP_BYTES of them, and back. */
#define WP_BYTES (sizeof WP_TOKEN + sizeof(wp_instance))
const char *wp_instance_pack(const wp_instance *saved, void *bytes, size_t size);
const char *wp_instance_unpack(wp_instance *saved, const void *bytes, size_t size);

/* Derivatives of unknowns along a direction of knowns, as long as no surface changes its mode. */
const char *wp_instance_derivative(const wp_instance *instance, const unsigned unknowns[], size_t count,
                                   const unsigned knowns[], size_t known_count, const double seed[], double found[]);

#endif
