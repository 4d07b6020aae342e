// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <set>
#include <string>
#include <vector>

#include "axiscal/acquisition/pose_model.hpp"
#include "axiscal/acquisition/session.hpp"
#include "axiscal/acquisition/stillness.hpp"

namespace axiscal {

/// The estimates of instrument and field in a session, from the prior and the readings so far.
class SessionKnowledge {
 public:
  /// @param setup, stillness  must outlive this object.
  /// @throws SetupError  if make_field_description() throws it.
  SessionKnowledge(const SessionSetup& setup, const Stillness& stillness);

  /// True if the direction of the field changes with time, as the direction of sunlight does.
  [[nodiscard]] bool field_moves() const;

  /// Computes a moving field at a time [s since 1970, UTC].
  void find_field_at(double time_s);

  /// @return the angle by which a moving field turns between two times [rad]; 0 for a fixed field.
  [[nodiscard]] double field_angle(double from_s, double to_s) const;

  /// @return the effect of the field on a reading: sensitivity times field magnitude [unit]; 0 if
  ///         the sensitivity is unknown.
  [[nodiscard]] double response_scale() const;

  /// @return the required duration of a reading [s].
  [[nodiscard]] double dwell_needed() const;

  /// Checks the stated unit by the magnitude of a reading at rest.
  /// @param level  field level of the requested point.
  /// @return a message if the unit seems wrong, an empty text if it seems right, nullopt if it
  ///         cannot be checked.
  [[nodiscard]] std::optional<std::string> unit_text(double level) const;

  /// @param entry  a point at which another reading would be taken.
  /// @param now_s  time of that reading, by the clock of CapturedReading::start_s [s].
  /// @return true if, according to the current estimates, the two readings must differ.
  [[nodiscard]] bool is_distinguishable_from(const CapturedReading& reading,
                                             const DesignEntry& entry,
                                             double now_s) const;

  /// @param readings  the earlier readings.
  /// @param reading   the new reading.
  /// @return the match of the new reading with the 24 poses; nullopt if the earlier readings do not
  ///         allow a prediction.
  [[nodiscard]] std::optional<PoseJudgement> judge(const std::vector<CapturedReading>& readings,
                                                   const CapturedReading& reading) const;

  /// A reading that looks like another pose.
  struct Suspect {
    int run = 0;
    DesignPoint looks_like;
  };

  /// Updates the estimates from all readings so far.
  /// @return the reading that now looks like another pose; nullopt if all readings fit.
  std::optional<Suspect> learn(const std::vector<CapturedReading>& readings);

  /// Accepts the stated pose of a run. The run never becomes a suspect.
  void accept_run(int run) { insisted_.insert(run); }

  /// Removes a dropped run from the suspects.
  void forget(int run) { suspects_.erase(run); }

  [[nodiscard]] const std::set<int>& suspects() const { return suspects_; }

  /// Sets the parts of a view that depend on the estimates: the suspects, the slope of the table,
  /// and the predicted uncertainty at the end.
  void show(const std::vector<CapturedReading>& readings,
            const std::vector<SessionStep>& steps,
            SessionView& view) const;

 private:
  [[nodiscard]] PoseModelSetup pose_model_setup() const;
  [[nodiscard]] Eigen::VectorXd u_of(const CapturedReading& reading) const;
  [[nodiscard]] static std::vector<CapturedReading> latest(
      const std::vector<CapturedReading>& readings);
  [[nodiscard]] PlacedReading placed(const CapturedReading& reading) const;
  [[nodiscard]] std::vector<PlacedReading> placed(const std::vector<CapturedReading>& readings,
                                                  std::optional<int> without = {}) const;
  [[nodiscard]] std::optional<double> expected_u_deg(const std::vector<CapturedReading>& readings,
                                                     const std::vector<SessionStep>& steps) const;

  const SessionSetup& setup_;
  const Stillness& stillness_;
  FieldDescription field_;
  double field_at_s_ = 0.0;  // time for which field_ is valid [s since 1970, UTC]
  std::optional<double> nominal_;
  PoseModel model_;
  std::vector<PoseModelFit> fits_;  // fits to the readings so far, the best fit first
  std::set<int> insisted_;          // runs whose stated pose was accepted
  std::set<int> suspects_;
};

}  // namespace axiscal
