#include <holdfast/pcl/impl/patch_estimation.hpp>

#include "input_point_types.h"

#include <pcl/impl/instantiate.hpp>

PCL_INSTANTIATE_PRODUCT(PatchEstimation,
                        (HOLDFAST_INPUT_POINT_TYPES)((holdfast::PatchPoint)))
