// SPDX-License-Identifier: Apache-2.0
#include "axiscal/acquisition/free_session.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <utility>

#include "acquisition/src/axis_intake.hpp"
#include "acquisition/src/dwell_sums.hpp"
#include "acquisition/src/session_end.hpp"
#include "acquisition/src/session_event_log.hpp"
#include "axiscal/acquisition/session.hpp"
#include "axiscal/calib/calibrate.hpp"
#include "axiscal/calib/orientation_quality.hpp"
#include "axiscal/calib/reading_uncertainty.hpp"
#include "axiscal/core/error.hpp"
#include "axiscal/core/number_text.hpp"
#include "axiscal/core/rounded_value.hpp"
#include "axiscal/core/units.hpp"
#include "core/formatted.hpp"
#include "core/json_document.hpp"

namespace axiscal {
namespace {

constexpr double store_every_s = 1.0;
constexpr double shortest_fit_spacing_s = 0.4;
constexpr double longest_fit_spacing_s = 5.0;  // measured by the sample times, not by real time
constexpr double share_of_time_for_fits = 0.1;
constexpr std::size_t fewest_points = 12;   // fewest points for a fit
constexpr std::size_t most_in_a_fit = 600;  // most points for each fit except the last one
// Smallest distance of a new point from the last one, divided by the radius of the points' sphere.
constexpr double novel_step = 0.03;
// Smallest angle between the direction of a new reading at rest and that of each earlier reading.
constexpr double novel_rest_rad = 0.12;

double seconds_now() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

// A kept reading.
struct FreePoint {
  double time_s = 0.0;
  Eigen::Vector3d values;
};

// Returns the largest expanded uncertainty of a measured direction [deg]. Only the uncertainty of
// the coefficients contributes to it.
double worst_direction_u_deg(const Calibration& calibration) {
  const Reducer reducer(calibration, {}, Force::yes);
  ReadingNoise none;
  none.sd = Eigen::VectorXd::Zero(3);
  const ReadingPropagation propagation(calibration, reducer, none);
  double worst = 0.0;
  for (int x = -1; x <= 1; ++x) {
    for (int y = -1; y <= 1; ++y) {
      for (int z = -1; z <= 1; ++z) {
        if (x != 0 || y != 0 || z != 0) {
          worst = std::max(worst, direction_uncertainty_deg(calibration, propagation,
                                                            Eigen::Vector3d(x, y, z).normalized()));
        }
      }
    }
  }
  return worst;
}

}  // namespace

class FreeSession::Engine {
 public:
  Engine(FreeSetup setup, Journal& journal)
      : setup_(std::move(setup)),
        journal_(journal),
        axes_(setup_.experiment.instrument),
        stillness_(3, setup_.stillness),
        dwell_(3) {
    if (setup_.experiment.instrument.axis_count() != 3) {
      throw SetupError("a session without a cube needs one instrument with three axes");
    }
    setup_.experiment.fit.method = Method::magnitude;
    view_.free.emplace();
    view_.free->wanted_deg = setup_.wanted_u_deg;
    view_.free->takes_rests = setup_.by_rests;
    view_.automatic = true;
  }

  void set_channels(const std::vector<Channel>& channels, std::optional<double> time_at_zero) {
    axes_.set_channels(channels);
    time_at_zero_ = time_at_zero;
  }

  void restore(const std::vector<std::string>& lines, const std::string& path) {
    for (std::size_t i = 1; i < lines.size(); ++i) {
      try {
        apply(parse_json(lines[i], path));
      } catch (const DataError& error) {
        throw DataError(path, i + 1, error.what());
      }
    }
    stored_ = points_.size();
    if (!points_.empty()) {
      news_.tell("resumed", formatted("{} readings restored", points_.size()));
      fit();
    }
  }

  void add(double time_s, std::span<const double> values) {
    const double gap = time_s - now_s_;
    const bool is_first = samples_++ == 0;
    now_s_ = time_s;
    news_.set_time(time_s);
    news_.set_alarm("silent", "");
    const bool is_good = axes_.take(values);
    news_.set_alarm("saturated", axes_.saturated_text());
    news_.set_alarm("not_a_number", axes_.missing_text());
    if (!is_good) {
      return;
    }
    if (!is_first && gap > setup_.stillness.window_s) {
      stillness_.restart();
      dwell_.clear();
    }
    stillness_.add(time_s, {axes_.values().data(), 3});
    if (phase_ == SessionPhase::waiting) {
      phase_ = SessionPhase::laying;
    }
    if (phase_ == SessionPhase::laying || phase_ == SessionPhase::dwelling) {
      setup_.by_rests ? take_rest() : take_sample();
      store_now_and_then();
      fit_now_and_then();
    }
  }

  void idle(double seconds) {
    if (samples_ > 0 && phase_ != SessionPhase::review) {
      news_.set_silence(seconds, stillness_.rate_hz());
    }
    store();
  }

  void set_source_alarms(const std::vector<SessionAlarm>& alarms) {
    news_.set_source_alarms(alarms);
  }

  void end_of_samples() {
    samples_ended_ = true;
    if (phase_ == SessionPhase::laying || phase_ == SessionPhase::dwelling) {
      review();
    }
  }

  void command(const SessionCommand& command) {
    switch (command.action) {
      case SessionAction::finish:
        finish();
        break;
      case SessionAction::go_on:
        if (phase_ == SessionPhase::paused && samples_ended_) {
          review();
        } else if (phase_ == SessionPhase::paused ||
                   (phase_ == SessionPhase::review && !samples_ended_)) {
          calibrations_.clear();
          view_.outcomes.clear();
          view_.result.clear();
          phase_ = SessionPhase::laying;
        }
        break;
      case SessionAction::undo:
        undo();
        break;
      case SessionAction::pause:
        if (phase_ == SessionPhase::laying || phase_ == SessionPhase::dwelling) {
          dwell_.clear();
          phase_ = SessionPhase::paused;
        }
        break;
      case SessionAction::quit:
        store();
        quit_ = true;
        phase_ = SessionPhase::over;
        break;
      default:
        news_.tell("refused", "a session without a cube does not have this command");
    }
  }

  [[nodiscard]] bool is_over() const { return phase_ == SessionPhase::over; }
  [[nodiscard]] bool has_quit() const { return quit_; }
  [[nodiscard]] std::vector<SessionEvent> take_events() { return news_.take_events(); }
  [[nodiscard]] const std::vector<Calibration>& calibrations() const { return calibrations_; }
  [[nodiscard]] Observations observations() const { return observations_of(1); }

  const SessionView& view() {
    FreeView& free = *view_.free;
    view_.phase = phase_;
    view_.alarms = news_.alarms();
    view_.stillness = stillness_.is_ready() ? stillness_.ratio() / stillness_.factor() : 0.0;
    view_.rate_hz = stillness_.rate_hz();
    view_.dwell_s = setup_.dwell_s;
    view_.progress = phase_ == SessionPhase::dwelling
                         ? std::clamp(dwell_.seconds() / setup_.dwell_s, 0.0, 1.0)
                         : 0.0;
    view_.done = points_.size();
    if (samples_ > 0) {
      free.now = axes_.values();
      view_.reading.assign(free.now.data(), free.now.data() + 3);
    }
    set_next_step_text();
    return view_;
  }

 private:
  // ---- readings ----

  [[nodiscard]] double shown_time(double time_s) const {
    return time_at_zero_.value_or(0.0) + time_s;
  }

  void keep(const FreePoint& point) {
    const Eigen::Vector3d& values = point.values;
    points_.push_back(point);
    view_.free->points.push_back(values);
    lowest_ = points_.size() == 1 ? values : Eigen::Vector3d(lowest_.cwiseMin(values));
    highest_ = points_.size() == 1 ? values : Eigen::Vector3d(highest_.cwiseMax(values));
    if (!view_.free->is_fitted) {
      view_.free->centre = 0.5 * (lowest_ + highest_);
      const double radius = 0.5 * (highest_ - lowest_).maxCoeff();
      view_.free->to_sphere = Eigen::Matrix3d::Identity() / (radius > 0.0 ? radius : 1.0);
    }
  }

  // Keeps the current sample only if it differs enough from the last kept sample. An instrument at
  // rest therefore does not fill the list.
  void take_sample() {
    const Eigen::Vector3d values = axes_.values();
    const double radius = 0.5 * (highest_ - lowest_).maxCoeff();
    const double way = points_.empty() ? 0.0 : (values - points_.back().values).norm();
    const double noise = stillness_.floor().norm();
    if (points_.empty() || (way > 4.0 * noise && way > novel_step * radius)) {
      if (points_.size() < setup_.most_points) {
        keep({.time_s = shown_time(now_s_), .values = values});
      } else {
        news_.set_alarm(
            "full", formatted("the limit of {} readings is reached; further readings are dropped",
                              setup_.most_points));
        if (setup_.unattended) {
          finish();
        }
      }
    }
  }

  // Takes one reading each time the instrument is held still, and keeps it if its direction is new.
  void take_rest() {
    const bool settled = stillness_.is_still() && stillness_.floor_age_s() > 0.2;
    if (!settled) {
      if (phase_ == SessionPhase::dwelling) {
        phase_ = SessionPhase::laying;
      }
      taken_ = false;
      dwell_.clear();
      return;
    }
    if (taken_) {
      return;
    }
    if (phase_ != SessionPhase::dwelling) {
      phase_ = SessionPhase::dwelling;
      dwell_.clear();
    }
    dwell_.add(now_s_, axes_.values());
    if (dwell_.seconds() + time_rounding_s < setup_.dwell_s ||
        dwell_.samples() < fewest_samples_of_dwell) {
      return;
    }
    taken_ = true;
    phase_ = SessionPhase::laying;
    const Eigen::Vector3d mean = dwell_.mean();
    stillness_.learn(dwell_.sd());
    // The radius is at least half the magnitude of the reading. Before the instrument is turned,
    // all readings are about equal, so their range would give a radius near 0.
    const double radius = std::max(0.5 * (highest_ - lowest_).maxCoeff(), 0.5 * mean.norm());
    const bool is_new = std::none_of(points_.begin(), points_.end(), [&](const FreePoint& one) {
      return (one.values - mean).norm() < novel_rest_rad * radius;
    });
    if (points_.empty() || is_new) {
      keep({.time_s = shown_time(dwell_.start_s()), .values = mean});
      known_again_ = 0;
      news_.tell("captured", formatted("reading {} was taken", points_.size()),
                 static_cast<int>(points_.size()));
    } else {
      news_.tell("as_before", "there is already a reading in this direction: turn to another one");
      // An unattended session ends after many consecutive readings without a new direction.
      constexpr int patience = 50;
      if (setup_.unattended && ++known_again_ >= patience) {
        finish();
      }
    }
  }

  void undo() {
    if (points_.empty() || !setup_.by_rests ||
        (phase_ != SessionPhase::laying && phase_ != SessionPhase::dwelling)) {
      return;
    }
    store();
    const std::string why = journal_.append(Json({{"entry", "free_undo"}, {"points", 1}}).dump());
    news_.set_alarm("disk", why);
    if (why.empty()) {
      drop_last();
      stored_ = points_.size();
      news_.tell("undo", "the last reading was dropped");
    }
  }

  void drop_last() {
    points_.pop_back();
    view_.free->points.pop_back();
    ++view_.free->dropped;
    for (std::size_t i = 0; i < points_.size(); ++i) {
      const Eigen::Vector3d& values = points_[i].values;
      lowest_ = i == 0 ? values : Eigen::Vector3d(lowest_.cwiseMin(values));
      highest_ = i == 0 ? values : Eigen::Vector3d(highest_.cwiseMax(values));
    }
    view_.free->is_enough = false;
    if (points_.size() >= fewest_points) {
      fit();
    } else {
      view_.free->is_fitted = false;
      view_.free->u_deg.reset();
      view_.free->fit_error.reset();
    }
  }

  // ---- the journal ----

  void apply(const JsonValue& entry) {
    const std::string kind = entry.at("entry").text();
    if (kind == "free_points") {
      for (const JsonValue& row : entry.at("rows").elements()) {
        const std::vector<JsonValue> numbers = row.elements();
        if (numbers.size() != 4) {
          row.fail("must contain a time and three values");
        }
        keep({.time_s = numbers[0].number(),
              .values = {numbers[1].number(), numbers[2].number(), numbers[3].number()}});
      }
    } else if (kind == "free_undo" && !points_.empty()) {
      drop_last();
    } else if (kind != "finished") {
      entry.fail("this entry does not belong to a session without a cube");
    }
  }

  void store_now_and_then() {
    if (now_s_ - tried_to_store_s_ >= store_every_s) {
      store();
    }
  }

  void store() {
    tried_to_store_s_ = now_s_;
    if (stored_ == points_.size()) {
      return;
    }
    Json rows = Json::array();
    for (std::size_t i = stored_; i < points_.size(); ++i) {
      const Eigen::Vector3d& v = points_[i].values;
      rows.push_back({points_[i].time_s, v.x(), v.y(), v.z()});
    }
    const std::string why =
        journal_.append(Json({{"entry", "free_points"}, {"rows", rows}}).dump());
    news_.set_alarm("disk", why);
    stored_ = why.empty() ? points_.size() : stored_;
  }

  // ---- the fit ----

  [[nodiscard]] Observations observations_of(std::size_t every) const {
    Observations all;
    const auto count = static_cast<Eigen::Index>((points_.size() + every - 1) / every);
    all.response.resize(count, 3);
    for (Eigen::Index i = 0; i < count; ++i) {
      const FreePoint& point = points_[static_cast<std::size_t>(i) * every];
      all.response.row(i) = point.values.transpose();
      all.readings.push_back({.run = static_cast<int>(i) + 1, .time_s = point.time_s});
    }
    return all;
  }

  void fit_now_and_then() {
    const double now = seconds_now();
    // In an unattended session, only the sample times determine when to fit, so that the same
    // samples give the same result.
    const bool due = (!setup_.unattended && now >= next_fit_s_) ||
                     now_s_ - fitted_at_s_ >= longest_fit_spacing_s;
    if (points_.size() < fewest_points || points_.size() == fitted_of_ || !due) {
      return;
    }
    fitted_at_s_ = now_s_;
    fit();
    const double cost = seconds_now() - now;
    next_fit_s_ = now + std::max(shortest_fit_spacing_s, cost / share_of_time_for_fits);
    if (setup_.unattended && view_.free->is_enough) {
      finish();
    }
  }

  void fit() {
    fitted_of_ = points_.size();
    FreeView& free = *view_.free;
    const std::size_t every = (points_.size() + most_in_a_fit - 1) / most_in_a_fit;
    Eigen::MatrixXd on_sphere(static_cast<Eigen::Index>(points_.size()), 3);
    try {
      const Calibration calibration = calibrate(setup_.experiment, observations_of(every));
      const double F = calibration.sensor.field.magnitude;
      free.centre = calibration.sensor.response.bias;
      free.to_sphere = Eigen::Matrix3d(calibration.sensor.response.sensitivity).inverse() / F;
      free.is_fitted = true;
      free.fit_error = calibration.fit.orientations
                           ? std::optional(calibration.fit.orientations->fit_error)
                           : std::nullopt;
      free.u_deg =
          worst_direction_u_deg(calibration);  // a fit to all points would give a smaller value
      show_numbers(calibration);
      why_none_.clear();
    } catch (const Error& error) {
      why_none_ = error.what();
      free.is_fitted = false;
      free.u_deg.reset();
      free.fit_error.reset();
    }
    for (std::size_t i = 0; i < points_.size(); ++i) {
      on_sphere.row(static_cast<Eigen::Index>(i)) =
          (free.to_sphere * (points_[i].values - free.centre)).transpose();
    }
    const OrientationQuality quality = orientation_quality(on_sphere, 1.0);
    free.coverage = quality.coverage;
    free.gap = quality.gap;
    free.largest_gap_rad = quality.largest_gap_rad;
    const bool was_enough = free.is_enough;
    free.is_enough = free.u_deg && *free.u_deg <= setup_.wanted_u_deg &&
                     free.largest_gap_rad <= largest_good_gap_rad;
    if (free.is_enough && !was_enough) {
      news_.tell("enough",
                 formatted("the target is reached: the uncertainty of a direction is at most {} "
                           "degrees (95 %)",
                           number_text(*free.u_deg, 2)));
    }
  }

  // Fills FreeView::numbers: hard and soft iron of a magnetometer, or bias and scales of another
  // instrument.
  void show_numbers(const Calibration& calibration) {
    const std::string& unit = calibration.sensor.instrument.unit;
    std::string bias;
    std::string scale;
    double largest = 0.0;
    const Eigen::Matrix3d S = calibration.sensor.response.sensitivity;
    const double mean = std::cbrt(std::abs(S.determinant()));
    for (Eigen::Index k = 0; k < 3; ++k) {
      const Quantity b = calibration.parameter(
          calibration.sensor.instrument.axes[static_cast<std::size_t>(k)] + ".bias");
      bias += formatted("{}{} \u00b1 {}", k > 0 ? ", " : "", rounded_value(b.value, b.U),
                        rounded_uncertainty(b.U));
      scale += formatted("{}{:+.2f} %", k > 0 ? ", " : "", 100.0 * (S(k, k) / mean - 1.0));
      for (Eigen::Index j = 0; j < 3; ++j) {
        largest = j == k ? largest : std::max(largest, std::abs(S(k, j)) / mean);
      }
    }
    const bool magnetic = calibration.sensor.instrument.kind == "magnetometer";
    view_.free->numbers = {{formatted("{} [{}]", magnetic ? "Hard iron" : "Bias", unit), bias},
                           {magnetic ? "Soft iron, scales" : "Scales, relative to mean", scale},
                           {magnetic ? "Soft iron (largest cross term)" : "Largest cross-axis term",
                            formatted("{:.2f} %", 100.0 * largest)}};
  }

  // ---- instructions to the person, and the end ----

  void set_next_step_text() {
    const FreeView& free = *view_.free;
    view_.headline.clear();
    view_.detail.clear();
    const std::string towards = direction_in_words(free.gap);
    switch (phase_) {
      case SessionPhase::waiting:
        view_.headline = "Waiting for the first sample";
        break;
      case SessionPhase::laying:
      case SessionPhase::dwelling:
        if (free.is_enough) {
          view_.headline = "The target is reached";
          view_.detail = "finish, or continue for smaller uncertainties";
        } else if (setup_.by_rests) {
          view_.headline = phase_ == SessionPhase::dwelling ? "Keep the instrument still"
                           : points_.size() < fewest_points
                               ? "Turn the instrument, hold it still for a second, and repeat"
                               : formatted("Hold the instrument still with {} up", towards);
        } else {
          view_.headline =
              points_.size() < fewest_points
                  ? "Turn the instrument slowly through all directions"
                  : formatted("Turn the instrument until {} points along the field", towards);
        }
        if (!free.is_enough) {
          view_.detail = !why_none_.empty() && points_.size() >= fewest_points
                             ? "no fit yet: more directions are needed"
                             : "move the marker to the glowing parts of the sphere";
        }
        break;
      case SessionPhase::paused:
        view_.headline = "Paused";
        break;
      case SessionPhase::review:
        view_.headline = calibrations_.empty() ? "The calibration failed" : "This is the result";
        view_.detail = joined(view_.result, "; ");
        break;
      default:
        view_.headline = quit_                        ? "Stopped"
                         : view_.outcomes.size() == 1 ? view_.outcomes.front().verdict
                                                      : "Done";
        view_.detail = joined(view_.result, "; ");
    }
  }

  void review() {
    store();
    phase_ = SessionPhase::review;
    calibrations_.clear();
    std::string why_none;
    try {
      calibrations_.push_back(calibrate(setup_.experiment, observations()));
    } catch (const Error& error) {
      why_none = error.what();
    }
    view_.result = review_session(calibrations_, why_none, {}, {}).lines;
    view_.outcomes.clear();
    for (const Calibration& calibration : calibrations_) {
      view_.outcomes.push_back(outcome_of(calibration));
    }
    news_.tell("review", joined(view_.result, "; "));
    if (setup_.unattended) {
      finish();
    }
  }

  void finish() {
    if (phase_ == SessionPhase::review) {
      const std::string why = journal_.append(Json({{"entry", "finished"}}).dump());
      news_.set_alarm("disk", why);
      if (why.empty()) {
        phase_ = SessionPhase::over;
        news_.tell("finished", "the session is finished");
      }
    } else if (points_.empty()) {
      news_.tell("refused",
                 "there are no readings yet: take at least one before you finish, or enter 'quit' "
                 "to stop the session");
    } else {
      review();
    }
  }

  FreeSetup setup_;
  Journal& journal_;
  std::optional<double> time_at_zero_;
  AxisIntake axes_;
  Stillness stillness_;
  DwellSums dwell_;
  SessionEventLog news_;
  SessionView view_;
  SessionPhase phase_ = SessionPhase::waiting;
  std::vector<FreePoint> points_;
  std::size_t stored_ = 0;  // number of points that are in the journal
  Eigen::Vector3d lowest_ = Eigen::Vector3d::Zero();
  Eigen::Vector3d highest_ = Eigen::Vector3d::Zero();
  std::size_t samples_ = 0;
  double now_s_ = 0.0;
  double tried_to_store_s_ = 0.0;
  bool taken_ = false;   // true if a reading was taken since the instrument came to rest
  int known_again_ = 0;  // number of consecutive readings without a new direction
  bool samples_ended_ = false;
  bool quit_ = false;
  std::size_t fitted_of_ = 0;
  double fitted_at_s_ = 0.0;  // sample time of the last fit
  double next_fit_s_ = 0.0;   // earliest time of the next fit, by seconds_now()
  std::string why_none_;
  std::vector<Calibration> calibrations_;
};

FreeSession::FreeSession(FreeSetup setup, Journal& journal)
    : engine_(std::make_unique<Engine>(std::move(setup), journal)) {}
FreeSession::~FreeSession() = default;

void FreeSession::set_channels(const std::vector<Channel>& channels,
                               std::optional<double> time_at_zero) {
  engine_->set_channels(channels, time_at_zero);
}
void FreeSession::restore(const std::vector<std::string>& lines, const std::string& path) {
  engine_->restore(lines, path);
}
void FreeSession::add(double time_s, std::span<const double> values) {
  engine_->add(time_s, values);
}
void FreeSession::idle(double seconds) {
  engine_->idle(seconds);
}
void FreeSession::set_source_alarms(const std::vector<SessionAlarm>& alarms) {
  engine_->set_source_alarms(alarms);
}
void FreeSession::command(const SessionCommand& command) {
  engine_->command(command);
}
void FreeSession::end_of_samples() {
  engine_->end_of_samples();
}
bool FreeSession::is_over() const {
  return engine_->is_over();
}
bool FreeSession::has_quit() const {
  return engine_->has_quit();
}
const SessionView& FreeSession::view() {
  return engine_->view();
}
std::vector<SessionEvent> FreeSession::take_events() {
  return engine_->take_events();
}
Observations FreeSession::observations() const {
  return engine_->observations();
}
const std::vector<Calibration>& FreeSession::calibrations() const {
  return engine_->calibrations();
}

}  // namespace axiscal
