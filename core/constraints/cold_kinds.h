// Kinds whose kernels are not inlined as a whole (cmake/Kernels.cmake): gcc compiles them faster and into half the bytes. Sweeps take the same
// number of instructions forward and up to 2.8 times as many with the gradient; direct blocks up to 1.2 and 1.7 times as many. A kind that is
// not named here is inlined as a whole.
#pragma once

#define SHEETBEND_COLD_KINDS(each) \
  each(PlanarBend)                 \
  each(YieldingCurvature)          \
  each(Shear)                      \
  each(SectionCurvature)           \
  each(SectionTwist)               \
  each(SectionYieldingCurvature)   \
  each(ExponentialStrain)          \
  each(SinhStrain)                 \
  each(SplineStrain)
