// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "axiscal/calib/observations.hpp"
#include "axiscal/instruments/instrument.hpp"
#include "axiscal/positioner/positioner.hpp"
#include "calib/cube/src/record_prior.hpp"

namespace axiscal {

/// The fit's input for one reference: n readings of m axes.
struct SolidReference {
  std::string slot;
  Observations run;
  LinearResponse calibrated;  // biases and sensitivities of the record
  // Covariance of the biases and sensitivities, axis by axis, 4m x 4m; zero if the record has none.
  Eigen::MatrixXd covariance;
  double calibration_dof = 0.0;  // degrees of freedom of `covariance`; 0: infinite
  double F = 1.0;                // magnitude of the field at level 1
  double sign = 1.0;             // -1 if the field points into the table
  // Zero-based index of the instrument. Several references may be from one instrument.
  std::size_t instrument = 0;
  std::vector<double> root_weights;  // one for each reading; their mean square is 1
  // For each reading, the zero-based index of the slope of the table that applies to it.
  std::vector<std::size_t> levels;
  std::size_t level_count = 1;  // number of different slopes of the table
};

struct SolidState {
  FaceNormals normals;
  std::vector<Eigen::Matrix3d> mounts;  // rotation_sensor_from_positioner
  // Field in the table frame, for each reference and slope.
  std::vector<std::vector<Eigen::Vector3d>> fields;
  std::vector<Eigen::VectorXd> bias;  // one for each reference
  // Factors by which the record's sensitivities are multiplied, m for each reference.
  std::vector<Eigen::VectorXd> scale;
  // For each instrument, the estimated error of its record. The error of the coefficients is
  // RecordPrior::root times this vector.
  std::vector<Eigen::VectorXd> shift;
};

/// The cube, the mounts and the slopes that fit all readings best.
struct SolidSolution {
  SolidState state;
  std::vector<double> sigma;    // scatter of a reading, for each reference [field unit]
  std::vector<int> worst_runs;  // run number of each reference's reading with the largest residual
  double degrees_of_freedom = 0.0;
  double calibration_dof = 0.0;        // effective degrees of freedom of handed_on; 0: infinite
  Eigen::Matrix<double, 18, 9> basis;  // basis of changes of the normals that do not turn the cube
  Eigen::Matrix<double, 9, 9> noise;   // covariance of the normals in `basis`, from the readings
  // Covariance of the normals in `basis`, from the errors of the instruments' calibrations.
  Eigen::Matrix<double, 9, 9> handed_on;
  std::vector<Eigen::Matrix3d> mount_noise;  // covariance of each mount, from the readings
};

/// Least-squares fit of the face normals of a cube (method.md, section 9).
///
/// The errors of the records are fitted too, with the records' covariances as their prior (random
/// effects). Therefore a difference between instruments does not increase the scatter of their
/// readings.
class SolidFit {
 public:
  /// @param references  the readings; must outlive the fit.
  /// @param drawing     the cube of the drawing. If it has feet, the feet of each face
  ///                    are rotated to its fitted normal.
  SolidFit(const std::vector<SolidReference>& references,
           const Positioner& drawing,
           bool free_bias_and_scale);

  /// @throws RefusedError, RankDeficientError  if the readings do not determine the cube.
  [[nodiscard]] SolidSolution solve() const;

  /// @return the positioner of the drawing with its face normals replaced by `normals`.
  [[nodiscard]] Positioner positioner_of(const FaceNormals& normals) const;

 private:
  struct Layout;
  struct Place;
  struct Problem;

  [[nodiscard]] SolidState start() const;
  [[nodiscard]] Layout layout(const SolidState& state) const;
  [[nodiscard]] Eigen::VectorXd residuals(const SolidState& state,
                                          const std::vector<double>& sigma) const;
  [[nodiscard]] Eigen::MatrixXd jacobian(const SolidState& state,
                                         const Layout& layout,
                                         const std::vector<double>& sigma) const;
  void move(SolidState& state, const Layout& layout, const Eigen::VectorXd& step) const;

  [[nodiscard]] std::vector<double> scatter(const std::vector<double>& sigma,
                                            const Eigen::VectorXd& residuals,
                                            const Eigen::VectorXd& leverage,
                                            double& degrees_of_freedom) const;
  [[nodiscard]] std::vector<int> worst_runs(const Eigen::VectorXd& residuals) const;
  void describe(const Layout& layout,
                const Eigen::MatrixXd& J,
                const Eigen::MatrixXd& C,
                SolidSolution& solution) const;

  // The response of a reference, corrected by the estimated error of its record.
  [[nodiscard]] LinearResponse response_of(const SolidState& state, std::size_t reference) const;

  const std::vector<SolidReference>& references_;
  const Positioner& drawing_;
  bool free_bias_and_scale_;
  std::vector<RecordPrior> priors_;  // one for each instrument
};

}  // namespace axiscal
