// How likely a contact fails, and the best places for a foot.
#include "bindings.h"

#include "arrays.h"
#include "contact_columns.h"
#include "foot_object.h"
#include "keywords.h"
#include "patch_map_object.h"
#include "patch_objects.h"

#include <holdfast/contact/names.h>

#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace holdfast::python {
namespace {

/// holdfast.ContactRisk
struct RiskObject {
  Foothold row;
};

/// holdfast.ContactRisks
struct RisksObject {
  std::vector<Foothold> rows;
};

void
requireSense(const std::string& error)
{
  if (!error.empty())
    throw py::value_error(error);
}

/// Yaw number i of one for all, or of as many as there are points.
double
yawAt(const Numbers& yaw, py::ssize_t i)
{
  return yaw.ndim() == 0 ? *yaw.data() : yaw.at(i);
}

Numbers
yawsOf(py::handle object, const Numbers& points)
{
  Numbers yaw = numbers(object, "yaw");
  const bool is_row =
      points.ndim() == 2 && yaw.ndim() == 1 && yaw.shape(0) == points.shape(0);
  if (yaw.ndim() != 0 && !is_row)
    failShape("yaw", "(), or (N,) beside points (N, 3),", yaw);
  return yaw;
}

/// A foothold without its risk for each point.
std::vector<Foothold>
plannedFor(py::handle point,
           py::handle load_direction,
           py::handle yaw,
           py::handle sole_normal)
{
  const Numbers points = numbers(point, "point");
  const py::ssize_t last = points.ndim() - 1;
  if (points.ndim() < 1 || points.ndim() > 2 || points.shape(last) != 3)
    failShape("point", "(3,) or (N, 3)", points);
  const Numbers yaws = yawsOf(yaw, points);
  Foothold foothold;
  foothold.placement.load_direction = vectorOf(load_direction, "load_direction");
  if (!sole_normal.is_none())
    foothold.placement.sole_normal = vectorOf(sole_normal, "sole_normal");
  requireSense(validityError(foothold.placement));
  std::vector<Foothold> planned(static_cast<std::size_t>(points.size() / 3), foothold);
  for (std::size_t i = 0; i < planned.size(); ++i) {
    Placement& placement = planned[i].placement;
    placement.point = Eigen::Map<const Eigen::Vector3d>(points.data() + 3 * i);
    placement.yaw = yawAt(yaws, static_cast<py::ssize_t>(i));
    if (const std::string error = validityError(placement); !error.empty())
      throw py::value_error("number " + std::to_string(i) + ": " + error);
  }
  return planned;
}

void
evaluate(const FitResult& fit, const Foot& foot, std::vector<Foothold>& footholds)
{
  const py::gil_scoped_release release;
  const auto surface = contactSurfaceOf(fit);
  for (Foothold& foothold : footholds)
    if (surface)
      foothold.risk = contactRisk(*surface, foot, foothold.placement);
}

/// Null for a map without patches.
const MapPatch*
nearestPatch(const PatchMap& map, const Eigen::Vector3d& point)
{
  const MapPatch* nearest = nullptr;
  double smallest = std::numeric_limits<double>::infinity();
  for (const MapPatch& patch : map.patches()) {
    const double distance = (patch.anchor.c - point).squaredNorm();
    if (distance < smallest) {
      smallest = distance;
      nearest = &patch;
    }
  }
  return nearest;
}

void
evaluate(const PatchMap& map, const Foot& foot, std::vector<Foothold>& footholds)
{
  if (footholds.empty())
    return;
  const SurfacePrior prior =
      surfacePriorOf(map, footholds.front().placement.load_direction);
  for (Foothold& foothold : footholds) {
    const MapPatch* patch = nearestPatch(map, foothold.placement.point);
    if (patch == nullptr)
      continue;
    foothold.patch = patch->id;
    foothold.views = patch->epochs;
    foothold.last_seen = patch->last_seen;
    foothold.risk =
        contactRisk(contactSurfaceOf(map, *patch, prior), foot, foothold.placement);
  }
}

py::object
contactRiskOf(const py::object& surface,
              const py::object& the_foot,
              const py::object& point,
              const py::object& load_direction,
              const py::object& yaw,
              const py::object& sole_normal)
{
  const Foot& foot = footOf(the_foot);
  std::vector<Foothold> rows = plannedFor(point, load_direction, yaw, sole_normal);
  if (py::isinstance<PatchObject>(surface))
    evaluate(surface.cast<const PatchObject&>().patch->fit, foot, rows);
  else if (py::isinstance<PatchMapObject>(surface))
    surface.cast<const PatchMapObject&>().ask([&](const PatchMap& map) {
      evaluate(map, foot, rows);
      return 0;
    });
  else
    throw py::type_error(
        "surface: a holdfast.Patch or a holdfast.PatchMap is needed, not " +
        kindText(surface));
  if (numbers(point, "point").ndim() == 1)
    return py::cast(RiskObject{std::move(rows.front())});
  return py::cast(RisksObject{std::move(rows)});
}

const Keywords<FootholdOptions>&
rankingKeywords()
{
  static const Keywords<FootholdOptions> keywords = [] {
    using O = FootholdOptions;
    Keywords<FootholdOptions> k("rank_footholds");
    k.add("yaws", &O::yaws, "directions of the sole that are tried, over a turn.")
        .add("spacing_m",
             &O::spacing_m,
             "between footholds, at least, m; 0: all of them.")
        .put(
            "max_footholds",
            [](O& o, py::handle value) {
              std::optional<int> most;
              read("max_footholds", value, most);
              o.max_footholds = most.value_or(std::numeric_limits<int>::max());
            },
            [](O&) { return std::string("None"); },
            "the best so many; None: all there are.")
        .add("threads", &O::threads, "0: one for each core.");
    return k;
  }();
  return keywords;
}

FootholdRanking
ranked(const py::object& patch_map,
       const py::object& foot,
       const py::object& load_direction,
       const py::kwargs& given)
{
  const PatchMapObject& asked = mapOf(patch_map);
  const Foot& used = footOf(foot);
  FootholdOptions options;
  options.load_direction = vectorOf(load_direction, "load_direction");
  rankingKeywords().set(options, given);
  requireSense(validityError(options));
  return asked.ask(
      [&](const PatchMap& map) { return rankFootholds(map, used, options); });
}

py::dict
countsOf(const FootholdRanking& ranking)
{
  py::dict out;
  out["candidates"] = ranking.candidates;
  out["footholds"] = ranking.footholds.size();
  out["unseen"] = ranking.unseen;
  out["without_support"] = ranking.without_support;
  out["not_facing"] = ranking.not_facing;
  out["too_near"] = ranking.too_near;
  out["beyond_limit"] = ranking.beyond_limit;
  return out;
}

/// Those that numpy would take from an array.
py::object
chosenFrom(const RisksObject& self, py::handle choice)
{
  const py::object chosen =
      py::module_::import("numpy").attr("arange")(self.rows.size())[choice];
  const auto numbers = py::array_t<std::int64_t, py::array::forcecast>(chosen);
  const auto row = [&](std::int64_t i) -> const Foothold& {
    return self.rows[static_cast<std::size_t>(i)];
  };
  if (numbers.ndim() == 0)
    return py::cast(RiskObject{row(*numbers.data())});
  if (numbers.ndim() != 1)
    throw py::index_error("risks stand in a row: choose by a number, a slice, a mask "
                          "(N,) or numbers (K,)");
  RisksObject out;
  for (py::ssize_t i = 0; i < numbers.shape(0); ++i)
    out.rows.push_back(row(numbers.at(i)));
  return py::cast(std::move(out));
}

std::string
riskText(const Foothold& row)
{
  if (!row.risk.quality)
    return std::string(kContactStatusNames.of(row.risk.status));
  return "total " +
         py::str("{:.3g}").format(row.risk.quality->risk.total).cast<std::string>();
}

std::string
rowHelp(const ContactColumn& column)
{
  return std::string(column.help) + "\nNone where it is not known.";
}

/// "(4, 4) of the sole" becomes "(N, 4, 4) of the sole".
std::string
rowsHelp(const ContactColumn& column)
{
  const std::string help = column.help;
  return help[0] == '(' ? "(N, " + help.substr(1) : "(N,) " + help;
}

void
bindOneRisk(py::module_& module)
{
  py::class_<RiskObject> type(
      module,
      "ContactRisk",
      "What contact_risk() says of one contact: `ok` first; without it all but the\n"
      "placement, `status` and `support_share` is None. `assumptions` says what the\n"
      "numbers take for granted.");
  for (const ContactColumn& column : contactColumns())
    type.def_property_readonly(
        column.name,
        [kept = &column](const RiskObject& self) { return kept->one(self.row); },
        rowHelp(column).c_str());
  type.def_property_readonly(
          "assumptions",
          [](const RiskObject&) { return riskAssumptions(); },
          "RISK_ASSUMPTIONS.")
      .def("__repr__", [](const RiskObject& self) {
        return "<holdfast.ContactRisk: " + riskText(self.row) + ">";
      });
}

py::dict
arraysOf(const RisksObject& self)
{
  py::dict out;
  for (const ContactColumn& column : contactColumns())
    out[column.name] = column.all(self.rows);
  return out;
}

void
bindManyRisks(py::module_& module)
{
  py::class_<RisksObject> type(
      module,
      "ContactRisks",
      "Contacts in a row, and what is known of them as arrays of N rows, which are "
      "the\ncaller's own; NaN where `ok` is False. `risks[3]` is a ContactRisk; a "
      "slice, a mask\nor numbers give ContactRisks: risks[risks.ok].total.");
  for (const ContactColumn& column : contactColumns())
    type.def_property_readonly(
        column.name,
        [kept = &column](const RisksObject& self) { return kept->all(self.rows); },
        rowsHelp(column).c_str());
  type.def_property_readonly(
          "assumptions",
          [](const RisksObject&) { return riskAssumptions(); },
          "RISK_ASSUMPTIONS.")
      .def("to_dict", arraysOf, "to_dict() -> dict of str: array\n\nAll by name.")
      .def("__len__", [](const RisksObject& self) { return self.rows.size(); })
      .def("__getitem__", chosenFrom, py::arg("choice"))
      .def("__iter__",
           [](const py::object& self) {
             return py::reinterpret_steal<py::object>(PySeqIter_New(self.ptr()));
           })
      .def("__repr__", [](const RisksObject& self) {
        return "<holdfast.ContactRisks: " + std::to_string(self.rows.size()) + ">";
      });
}

void
bindRanking(py::module_& module)
{
  py::class_<FootholdRanking>(
      module,
      "FootholdRanking",
      "What rank_footholds() found. Every patch of the map is a foothold, or in one "
      "of\n`counts`.")
      .def_property_readonly(
          "footholds",
          [](const FootholdRanking& r) { return RisksObject{r.footholds}; },
          "ContactRisks, all of them ok, best first: by `total` in steps of 1e-6, "
          "then by\ncontact area. The best of many is the best partly by luck: its "
          "number is a\nlittle too small.")
      .def_property_readonly(
          "tried",
          [](const FootholdRanking& r) { return RisksObject{r.tried}; },
          "ContactRisks of every patch at its best yaw, in the order of the map's\n"
          "`patches`, also those that are not ok.")
      .def_property_readonly(
          "counts",
          countsOf,
          "dict: 'candidates' (patches of the map) are 'footholds', 'unseen' (no "
          "support\nknown), 'without_support' (the sole reaches beyond what was "
          "seen), 'not_facing'\nthe load, 'too_near' a better one or 'beyond_limit'.")
      .def_property_readonly(
          "widest_support_m",
          [](const FootholdRanking& r) { return r.widest_support_m; },
          "How far the widest patch was seen from its middle, m: a sole that reaches\n"
          "further (Foot.reach) wants a map of a larger radius_m.")
      .def_property_readonly(
          "assumptions",
          [](const FootholdRanking&) { return riskAssumptions(); },
          "RISK_ASSUMPTIONS.")
      .def("__len__", [](const FootholdRanking& r) { return r.footholds.size(); })
      .def("__repr__", [](const FootholdRanking& r) {
        return "<holdfast.FootholdRanking: " + std::to_string(r.footholds.size()) +
               " footholds on " + std::to_string(r.candidates) + " patches>";
      });
}

std::string
riskHelp()
{
  return documented(
      "contact_risk(surface, foot, point, load_direction, *, yaw=0.0, "
      "sole_normal=None)",
      "How likely a contact fails, over what the surface may be given all that was\n"
      "measured of it.\n"
      "\n"
      "    >>> foot = holdfast.Foot.load('humanoid_foot')\n"
      "    >>> risk = holdfast.contact_risk(patch, foot, patch.centre, (0, 1, 0))\n"
      "    >>> if risk.ok:\n"
      "    ...     print(risk.total, risk.slip, risk.gap, risk.pose)\n"
      "\n"
      "Arguments\n"
      "    surface: a Patch, which was seen wherever its boundary is; or a PatchMap, "
      "of\n"
      "        which the patch counts whose anchor is nearest to the point, with what "
      "its\n"
      "        views and the whole map tell of how rough surfaces are there.\n"
      "    foot: a Foot.\n"
      "    point: (3,) where the load acts, m, frame of the patch's points or of the "
      "map;\n"
      "        or (N, 3), of which all are worked out.\n"
      "    load_direction: (3,) of the force on the surface, same frame, of any "
      "length:\n"
      "        down. The frame of a camera has y down, so there is no default.\n"
      "    yaw: of the sole's x axis about the axis against the load, rad; 0: the "
      "frame's\n"
      "        x axis as seen along the load, or y where the load is along x. (N,) "
      "beside\n"
      "        (N, 3) points.\n"
      "    sole_normal: (3,) of a stiff ankle's sole, out of the surface; None: the "
      "normal\n"
      "        that is expected.\n"
      "\n"
      "Returns\n"
      "    a ContactRisk; ContactRisks for (N, 3) points. Where less than "
      "`min_support` of\n"
      "    the sole is over surface that was seen there is no number: look at `ok` "
      "first.\n" +
          riskAssumptionsHelp() +
          "\n"
          "Raises\n"
          "    TypeError: an argument is of another kind.\n"
          "    ValueError: a shape is wrong, a number is not finite, a direction is "
          "zero.\n"
          "\n"
          "The interpreter's lock is released while it computes.");
}

std::string
rankingHelp()
{
  return documented(
      "rank_footholds(patch_map, foot, load_direction, *, " +
          rankingKeywords().signature() + ")",
      "The best places for a foot on a map: tries every patch at the middle of what "
      "was\nseen of it, in the direction that is best there.\n"
      "\n"
      "    >>> ranking = holdfast.rank_footholds(patch_map, foot, (0, 1, 0))\n"
      "    >>> best = ranking.footholds                # best first\n"
      "    >>> best.total, best.pose, best.pose_covariance\n"
      "    >>> ranking.counts                          # what was left out, and why\n"
      "\n"
      "Arguments\n"
      "    patch_map: a PatchMap.\n"
      "    foot: a Foot.\n"
      "    load_direction: (3,) of the force on the surface, frame of the map, of "
      "any\n"
      "        length: down. The map's frame is the camera's at first, with y down "
      "where\n"
      "        it looks straight ahead.\n" +
          rankingKeywords().help() +
          "\n"
          "Returns\n"
          "    a FootholdRanking. It does not depend on the number of threads.\n" +
          riskAssumptionsHelp() +
          "\n"
          "Raises\n"
          "    TypeError: an argument is of another kind, or there is no such option.\n"
          "    ValueError: a number makes no sense, a direction is zero.\n"
          "\n"
          "The interpreter's lock is released while it computes.");
}

} // namespace

void
bindContact(py::module_& module)
{
  bindOneRisk(module);
  bindManyRisks(module);
  bindRanking(module);
  module.attr("RISK_ASSUMPTIONS") = riskAssumptions();
  module.def("contact_risk",
             contactRiskOf,
             py::arg("surface"),
             py::arg("foot"),
             py::arg("point"),
             py::arg("load_direction"),
             py::kw_only(),
             py::arg("yaw") = 0.0,
             py::arg("sole_normal") = py::none(),
             riskHelp().c_str());
  module.def("rank_footholds",
             ranked,
             py::arg("patch_map"),
             py::arg("foot"),
             py::arg("load_direction"),
             rankingHelp().c_str());
}

} // namespace holdfast::python
