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

/// The knowledge of a session about its instrument and field: the prior, and the readings so far.
class SessionKnowledge {
 public:
  /// @param setup, stillness  must outlive it.
  /// @throws SetupError  as make_field_description().
  SessionKnowledge(const SessionSetup& setup, const Stillness& stillness);

  /// True if the field moves, as the sun does.
  [[nodiscard]] bool field_moves() const;

  /// From now on it knows a moving field as it stood then [s since 1970, UTC].
  void find_field_at(double time_s);

  /// @return the rotation of a moving field between two times [rad]; otherwise 0.
  [[nodiscard]] double field_angle(double from_s, double to_s) const;

  /// @return the effect of the field on a reading [unit]; 0 if it is unknown.
  [[nodiscard]] double response_scale() const;

  /// @return how long a reading is to be taken [s].
  [[nodiscard]] double dwell_needed() const;

  /// @param level  of the point that is wanted.
  /// @return a message about the unit from the length of a still reading, empty without a problem;
  ///         nullopt if it cannot be checked.
  [[nodiscard]] std::optional<std::string> unit_text(double level) const;

  /// @param now_s  when the other one would be taken, as a reading's start_s.
  /// @return true if a point must differ from a reading, by the current knowledge.
  [[nodiscard]] bool is_distinguishable_from(const CapturedReading& reading,
                                             const DesignEntry& entry,
                                             double now_s) const;

  /// @return the match of a new reading with the earlier ones; nullopt while they are not enough.
  [[nodiscard]] std::optional<PoseJudgement> judge(const std::vector<CapturedReading>& readings,
                                                   const CapturedReading& reading) const;

  /// A reading that looks like another pose.
  struct Suspect {
    int run = 0;
    DesignPoint looks_like;
  };

  /// Takes up all readings so far.
  /// @return the one that looks like another pose now that more is known.
  std::optional<Suspect> learn(const std::vector<CapturedReading>& readings);

  /// A run is taken as right, whatever it looks like: it becomes no suspect.
  void accept_run(int run) { insisted_.insert(run); }

  /// A run was dropped.
  void forget(int run) { suspects_.erase(run); }

  [[nodiscard]] const std::set<int>& suspects() const { return suspects_; }

  /// Sets the parts of a view that depend on it: suspects, the table's slope, the uncertainty at
  /// the end.
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
  double field_at_s_ = 0.0;  // time of the field in field_ [s since 1970, UTC]
  std::optional<double> nominal_;
  PoseModel model_;
  std::vector<PoseModelFit> fits_;  // by the readings so far, the best one first
  std::set<int> insisted_;          // runs that are taken as right
  std::set<int> suspects_;
};

}  // namespace axiscal
