/// \file What is known of a patch, alike for one and for many.
#pragma once

#include <holdfast/pcl/patch_extraction.h>

#include <holdfast/patch/tessellation.h>

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace holdfast::python {

/// "sphere", "plane_circle": planes are told apart by their boundary.
std::string typeName(PatchType type);

/// Names of the flags that are set.
std::vector<std::string> flagNames(const FitFlags& flags);

/// State of a fit less that of a reference, in the reference's axes. Elliptic and
/// hyperbolic paraboloids have the same coordinates, and are told apart by a sign that
/// noise may turn. Empty where one is not usable, or the types differ otherwise.
StateVector stateDifference(const FitResult& fit, const FitResult& reference);

/// \param spacing m; none: an eighth of the longest bound.
Mesh meshOf(const Patch& patch, const std::optional<double>& spacing);

/// Adds a mesh behind others.
void append(const Mesh& mesh,
            std::vector<double>& vertices,
            std::vector<std::int32_t>& triangles);

/// The type a fit came out with, or one of the two names of its parts, is `word`.
/// \throw std::invalid_argument for a word that names no type.
bool isOfType(const ExtractedPatch& patch, const std::string& word);

} // namespace holdfast::python
