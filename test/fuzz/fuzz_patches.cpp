/// \file Results (JSON) of any bytes; what can be read survives being written.
#include "fuzz.h"
#include <holdfast/io/patch_io.h>
#include <holdfast/patch/parameters.h>

#include <sstream>

namespace {

using namespace holdfast;
using fuzz::require;

/// Equal, or both not a number.
template <typename Matrix>
bool
same(const Matrix& a, const Matrix& b)
{
  if (a.rows() != b.rows() || a.cols() != b.cols())
    return false;
  const auto equal = a.array() == b.array();
  const auto both_nan = a.array().isNaN() && b.array().isNaN();
  return (equal || both_nan).all();
}

bool
same(double a, double b)
{
  return a == b || (a != a && b != b);
}

void
requireSame(const ExtractedPatch& a, const ExtractedPatch& b)
{
  require(a.fit.patch.type == b.fit.patch.type, "the type is read back");
  require(same(pack(a.fit.patch), pack(b.fit.patch)), "parameters are read back");
  require(same(a.fit.covariance, b.fit.covariance), "covariances are read back");
  require(a.fit.status == b.fit.status && a.fit.points == b.fit.points &&
              a.fit.chi2_dof == b.fit.chi2_dof && a.fit.iterations == b.fit.iterations,
          "status and counts are read back");
  require(same(a.fit.chi2, b.fit.chi2), "chi2 is read back");
  require(a.seed_index == b.seed_index && same(a.seed, b.seed),
          "the seed is read back");
  require(a.validation.has_value() == b.validation.has_value(),
          "measurements are read back");
  if (a.validation)
    require(same(a.validation->residual.rms_m, b.validation->residual.rms_m) &&
                same(a.validation->coverage.share, b.validation->coverage.share),
            "measurements are read back");
}

std::string
written(const PatchReport& report, JsonLayout layout)
{
  std::ostringstream out;
  writeJson(out, report, layout);
  return out.str();
}

void
requireRoundTrip(const PatchReport& report, JsonLayout layout)
{
  const PatchReport back = readJson(written(report, layout));
  require(back.cloud == report.cloud, "the name is read back");
  require(back.result.rejected == report.result.rejected &&
              back.result.turned_down == report.result.turned_down,
          "rejected counts are read back");
  const auto& patches = report.result.patches;
  require(back.result.patches.size() == patches.size(), "all patches are read back");
  for (std::size_t i = 0; i < patches.size(); ++i)
    requireSame(patches[i], back.result.patches[i]);
}

} // namespace

int
LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size)
{
  PatchReport report;
  try {
    report = readJson(std::string(reinterpret_cast<const char*>(data), size));
  }
  catch (const std::runtime_error& error) {
    fuzz::requireOneLine(error);
    return 0;
  }
  requireRoundTrip(report, JsonLayout::OneLine);
  requireRoundTrip(report, JsonLayout::PatchPerLine);
  return 0;
}
