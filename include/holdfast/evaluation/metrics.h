/// \file How large a covariance is in terms people can picture: the distances of the
/// paper's section IV-A between patches, and principal standard deviations.
#pragma once

#include <holdfast/patch/parameters.h>

#include <random>
#include <string>
#include <vector>

namespace holdfast {

/// Distances between a fitted patch p and another s of the same type. A revolute patch
/// is the same turned about its normal, so its orientations are compared by the turn
/// between them that is smallest, which takes one normal to the other.
struct PatchDistances {
  /// Paper eq. (18): spectral norm |I - R_p R_s^T|_2 = 2 sin(Phi_6 / 2), in [0, 2].
  double phi_5 = 0.0;
  /// Paper eq. (19): |log(R_p R_s^T)|, the angle between the orientations, in [0, pi]
  /// rad. (That the paper calls Phi_5 equivalent to this angle is a slip.)
  double phi_6 = 0.0;
  /// Paper eq. (20), which lacks the difference: sqrt((c_p - c_s)^T (c_p - c_s)), m.
  double phi_t = 0.0;
  /// |k_p - k_s|, 1/m; zero for planes.
  double phi_k = 0.0;
  /// |d_p - d_s|, m. As in the paper, a quad's gamma (rad) counts like its lengths.
  double phi_d = 0.0;
};

/// \throw std::invalid_argument when the types differ.
PatchDistances patchDistances(const Patch& p, const Patch& s);

struct MeanAndVariance {
  double mean = 0.0;
  double variance = 0.0; ///< unbiased, over n - 1
};

/// Mean and variance of each distance over a set of patches. Units as PatchDistances,
/// squared for variances. (What the paper's Table I prints behind "+-" is the
/// variance.)
struct PatchMetrics {
  MeanAndVariance phi_5;
  MeanAndVariance phi_6;
  MeanAndVariance phi_t;
  MeanAndVariance phi_k;
  MeanAndVariance phi_d;
};

/// Metrics of the distances from `patch` to given parameter vectors of the same type.
/// \throw std::invalid_argument for fewer than two samples or a wrong length.
PatchMetrics metricsOf(const Patch& patch, const std::vector<ParameterVector>& samples);

/// Metrics over n_v patches drawn from N(parameters of the patch, covariance), paper
/// section IV-A. Rank-deficient covariances are fine. Orientations of revolute types
/// keep r_z = 0.
/// \param covariance of [d | k | r | c].
/// \throw std::invalid_argument for n_v < 2 or a covariance of the wrong size.
PatchMetrics sampleMetrics(const Patch& patch,
                           const ParameterMatrix& covariance,
                           std::mt19937_64& generator,
                           int n_v = 10000);

/// One principal axis of a covariance.
struct PrincipalDeviation {
  double sigma = 0.0;
  /// Components of the unit eigenvector that make up nine tenths of its squared length,
  /// the largest first.
  struct Component {
    std::string name; ///< as in parameterNames()
    double weight = 0.0;
  };
  std::vector<Component> components;
};

/// Standard deviations along the eigenvectors of a covariance, descending. Parameters
/// count in their own units: an eigenvector weighs 1 m, 1 rad and 1/m alike. The sign
/// of each makes its largest component positive.
/// \param covariance of the type's parameters, [d | k | r | c].
/// \throw std::invalid_argument for a covariance of the wrong size.
std::vector<PrincipalDeviation> principalDeviations(PatchType type,
                                                    const ParameterMatrix& covariance);

} // namespace holdfast
