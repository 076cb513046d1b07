/* Precision: double, or with WP_SINGLE defined float. Every number of the source is written through WP_R. */
#ifdef WP_SINGLE
typedef float wp_real;
#define WP_R(x) x##f
#else
typedef double wp_real;
#define WP_R(x) x
#endif
