#include <holdfast/pcl/patch_extraction.h>

namespace holdfast {

bool
isAccepted(const ExtractedPatch& patch)
{
  return isUsable(patch.fit.status) &&
         (!patch.validation || patch.validation->verdict == PatchVerdict::Accepted);
}

} // namespace holdfast
