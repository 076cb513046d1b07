/* Precision: double, or with WP_SINGLE defined float. Every number of the source is written through WP_R. Library and
   program must agree, else they do not link: define it for the whole build, or in a file wheelpend_config.h beside this
   one (an Arduino library sees no definition of the sketch's). */
#ifdef __has_include
#if __has_include("wheelpend_config.h")
#include "wheelpend_config.h"
#endif
#endif
#ifdef WP_SINGLE
typedef float wp_real;
#define WP_R(x) x##f
#else
typedef double wp_real;
#define WP_R(x) x
#endif
