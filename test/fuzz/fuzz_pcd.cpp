/// \file PCD files of any bytes.
#include "load_cloud.h"

int
LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size)
{
  return holdfast::fuzz::loadAnything(data, size);
}
