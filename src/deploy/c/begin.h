/* Every number here is an IEEE 754 single, every operation is rounded by itself, and flappy_fma() is rounded once: so the
   same bits come out everywhere. What would change them is switched off, or refused where it can be told. Under clang
   keep -ffp-contract=fast and -funsafe-math-optimizations away: no pragma overrides them and nothing tells them. */
#if !defined __GNUC__
#error "gcc (from 9) or clang (from 11) is needed: the arithmetic of other compilers was not tried"
#elif defined __FAST_MATH__
#error "-ffast-math, or -Ofast, changes the results: leave it away"
#elif defined __ASSOCIATIVE_MATH__ && defined __RECIPROCAL_MATH__
#error "-funsafe-math-optimizations changes the results: leave it away"
#elif defined __ASSOCIATIVE_MATH__
#error "-fassociative-math changes the results: leave it away"
#elif defined __RECIPROCAL_MATH__
#error "-freciprocal-math changes the results: leave it away"
#elif __FINITE_MATH_ONLY__
#error "-ffinite-math-only lets NaN pass: leave it away"
#elif __FLT_RADIX__ != 2 || __FLT_MANT_DIG__ != 24 || __FLT_MAX_EXP__ != 128 || __DBL_MANT_DIG__ != 53
#error "float and double have to be IEEE 754 single and double"
#elif __FLT_EVAL_METHOD__ != 0 && __FLT_EVAL_METHOD__ != 16
#error "float is evaluated in a wider type: on 32-bit x86 use -msse2 -mfpmath=sse"
#endif
#if defined __clang__
#if defined __x86_64__ || defined __i386__
#pragma float_control(precise, on, push)
#endif
#pragma STDC FP_CONTRACT OFF
#else
#pragma GCC push_options
#pragma GCC optimize("fp-contract=off")
#endif
