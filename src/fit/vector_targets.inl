// Which of Highway's instruction sets are compiled, one of which is chosen at run time.
// Included before hwy/foreach_target.h, by each file that is compiled for several.

// The steps between SSSE3, AVX2 and AVX-512 gain nothing here; scalable vectors cannot
// be members of a class.
#define HOLDFAST_USELESS_TARGETS \
  (HWY_SSE4 | HWY_AVX3_DL | HWY_SVE | HWY_SVE2 | HWY_SVE_256 | HWY_SVE2_128 | HWY_RVV)

#undef HWY_DISABLED_TARGETS
#ifdef HOLDFAST_QUICKSTART
#define HWY_DISABLED_TARGETS (HOLDFAST_USELESS_TARGETS | HWY_SSSE3 | HWY_AVX3)
#else
#define HWY_DISABLED_TARGETS HOLDFAST_USELESS_TARGETS
#endif
