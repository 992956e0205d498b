#include <holdfast/pcl/impl/sac_model_patch.hpp>

#include "input_point_types.h"

#include <pcl/impl/instantiate.hpp>

PCL_INSTANTIATE(SampleConsensusModelPatch, HOLDFAST_INPUT_POINT_TYPES)
