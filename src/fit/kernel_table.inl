// The functions of the kernel as callers see them, of the instruction set this file is
// being compiled for. Included after kernel_point.inl and accumulateNormalIn(),
// accumulateCovarianceIn(), sumOverCellsIn() with a precision.

constexpr Kernel
makeKernel(const char* instruction_set)
{
  return {instruction_set,
          accumulateScatter,
          accumulateQuadric,
          moveOntoQuadric,
          accumulateNormalIn,
          accumulateCovarianceIn,
          squaredResiduals,
          placePoints,
          meetRays,
          accumulatePixels,
          neighborVariances,
          sumOverCellsIn,
          congruence};
}
