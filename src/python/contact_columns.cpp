#include "contact_columns.h"

#include "arrays.h"
#include "bindings.h"
#include "keywords.h"

#include <holdfast/contact/names.h>

#include <algorithm>
#include <cstdint>
#include <limits>
#include <string>
#include <string_view>

namespace holdfast::python {
namespace {

using Rows = std::vector<Foothold>;

py::ssize_t
countOf(const Rows& rows)
{
  return static_cast<py::ssize_t>(rows.size());
}

/// Known of every contact: a whole number, a number or a bool.
template <typename T, typename Value>
ContactColumn
always(const char* name, Value value, const char* help)
{
  const auto all = [value](const Rows& rows) -> py::array {
    auto column = newArray<T>({countOf(rows)});
    std::transform(rows.begin(), rows.end(), column.mutable_data(), [&](const auto& f) {
      return static_cast<T>(value(f));
    });
    return std::move(column);
  };
  const auto one = [value](const Foothold& f) -> py::object {
    return py::cast(static_cast<T>(value(f)));
  };
  return {name, all, one, help};
}

/// Where there is a quality: a number, else NaN.
template <typename Value>
ContactColumn
number(const char* name, Value value, const char* help)
{
  const auto all = [value](const Rows& rows) -> py::array {
    auto column = newArray<double>({countOf(rows)});
    std::transform(rows.begin(), rows.end(), column.mutable_data(), [&](const auto& f) {
      return f.risk.quality ? value(*f.risk.quality) :
                              std::numeric_limits<double>::quiet_NaN();
    });
    return std::move(column);
  };
  const auto one = [value](const Foothold& f) -> py::object {
    if (!f.risk.quality)
      return py::none();
    return py::float_(value(*f.risk.quality));
  };
  return {name, all, one, help};
}

/// The same of square matrices.
template <typename Value>
ContactColumn
matrix(const char* name, py::ssize_t width, Value value, const char* help)
{
  const auto all = [value, width](const Rows& rows) -> py::array {
    auto column = newArray<double>({countOf(rows), width, width});
    double* out = column.mutable_data();
    std::fill_n(out, column.size(), std::numeric_limits<double>::quiet_NaN());
    for (const Foothold& f : rows) {
      if (f.risk.quality)
        std::copy_n(py::array_t<double>(value(*f.risk.quality)).data(),
                    width * width,
                    out);
      out += width * width;
    }
    return std::move(column);
  };
  const auto one = [value](const Foothold& f) -> py::object {
    if (!f.risk.quality)
      return py::none();
    return value(*f.risk.quality);
  };
  return {name, all, one, help};
}

ContactColumn
statusColumn()
{
  const auto word = [](const Foothold& f) {
    return std::string(kContactStatusNames.of(f.risk.status));
  };
  const auto all = [word](const Rows& rows) -> py::array {
    py::list texts;
    for (const Foothold& f : rows)
      texts.append(word(f));
    return py::module_::import("numpy").attr("array")(texts, py::arg("dtype") = "U");
  };
  return {"status",
          all,
          [word](const Foothold& f) -> py::object { return py::str(word(f)); },
          "text: 'ok', 'insufficient_support' (too little of what is under the sole\n"
          "was seen) or 'not_facing_the_load'."};
}

ContactColumn
pointColumn()
{
  const auto all = [](const Rows& rows) -> py::array {
    auto column = newArray<double>({countOf(rows), 3});
    double* out = column.mutable_data();
    for (const Foothold& f : rows)
      out = std::copy_n(f.placement.point.data(), 3, out);
    return std::move(column);
  };
  return {"point",
          all,
          [](const Foothold& f) -> py::object { return toArray(f.placement.point); },
          "(3,) where the load acts, as planned, m."};
}

std::vector<ContactColumn>
placeColumns()
{
  return {
      always<std::int64_t>(
          "patch",
          [](const Foothold& f) { return f.patch; },
          "number of the patch in its map, from 1; 0: it is of no map."),
      pointColumn(),
      always<double>(
          "yaw",
          [](const Foothold& f) { return f.placement.yaw; },
          "of the sole's x axis about the axis against the load, rad."),
      statusColumn(),
      always<bool>(
          "ok",
          [](const Foothold& f) { return f.risk.quality.has_value(); },
          "bool: there are risks. Never that a step is safe."),
      always<double>(
          "support_share",
          [](const Foothold& f) { return f.risk.support_share; },
          "share of the sole that is over surface that was seen."),
      always<std::int64_t>(
          "views",
          [](const Foothold& f) { return f.views; },
          "independent views of a map's patch; 0: it is of no map."),
      always<std::int64_t>(
          "last_seen",
          [](const Foothold& f) { return f.last_seen; },
          "number of the map's update that saw the patch last; 0: of no map."),
  };
}

std::vector<ContactColumn>
riskColumns()
{
  using Q = ContactQuality;
  return {
      number(
          "slip",
          [](const Q& q) { return q.risk.slip; },
          "probability that the slope is beyond friction."),
      number(
          "height",
          [](const Q& q) { return q.risk.height; },
          "probability that the surface is beyond `height_m` off the point, along the\n"
          "load."),
      number(
          "tilt",
          [](const Q& q) { return q.risk.tilt; },
          "probability that the surface is tilted beyond `tilt_rad` against a stiff\n"
          "ankle's sole; 0 with a compliant one."),
      number(
          "gap",
          [](const Q& q) { return q.risk.gap; },
          "probability that the surface is beyond `gap_m` off the sole somewhere."),
      number(
          "support",
          [](const Q& q) { return q.risk.support; },
          "share of the sole over surface that was not seen."),
      number(
          "total",
          [](const Q& q) { return q.risk.total; },
          "sum of these, at most 1: no less than the probability that any happens."),
      number(
          "joint",
          [](const Q& q) { return q.risk.joint; },
          "that probability, with what the events have in common."),
  };
}

std::vector<ContactColumn>
contactPlaces()
{
  using Q = ContactQuality;
  return {
      number(
          "cvar_gap_m",
          [](const Q& q) { return q.cvar_gap_m; },
          "mean of the worst twentieth of gaps at the worst place of the sole, m."),
      number(
          "contact_area_m2",
          [](const Q& q) { return q.contact_area_m2; },
          "expected area nearer than `contact_m`, m^2."),
      matrix(
          "pose",
          4,
          [](const Q& q) { return toArray(q.pose); },
          "(4, 4) of the sole as it will lie, in the frame of the surface: origin on\n"
          "the surface along the load, x forward, z out of the surface, m."),
      matrix(
          "pose_covariance",
          6,
          [](const Q& q) { return toArray(q.pose_covariance); },
          "(6, 6) of (rotation in the sole's axes, rad; translation in those of the\n"
          "surface's frame, m). Of rank 1 with a stiff ankle, else 3."),
  };
}

} // namespace

const std::vector<ContactColumn>&
contactColumns()
{
  static const std::vector<ContactColumn> columns = [] {
    std::vector<ContactColumn> all;
    for (const auto& part : {placeColumns(), riskColumns(), contactPlaces()})
      all.insert(all.end(), part.begin(), part.end());
    return all;
  }();
  return columns;
}

py::tuple
riskAssumptions()
{
  py::tuple out(kRiskAssumptions.size());
  for (std::size_t i = 0; i < kRiskAssumptions.size(); ++i)
    out[i] = py::str(std::string(kRiskAssumptions[i]));
  return out;
}

std::string
riskAssumptionsHelp()
{
  std::string text = "\nTakes for granted (RISK_ASSUMPTIONS)\n";
  for (const std::string_view each : kRiskAssumptions)
    text += wrapped("- " + std::string(each) + ".");
  return text;
}

} // namespace holdfast::python
