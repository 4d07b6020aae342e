// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <cstdio>
#include <filesystem>

#include <fmt/format.h>
#include <unistd.h>

#include "axiscal/acquisition/health_watch.hpp"
#include "axiscal/acquisition/journal.hpp"
#include "axiscal/acquisition/open_source.hpp"
#include "axiscal/acquisition/sample_feed.hpp"
#include "axiscal/acquisition/session.hpp"
#include "axiscal/acquisition/session_face.hpp"
#include "axiscal/acquisition/web_face.hpp"
#include "axiscal/calib/calibration_json.hpp"
#include "axiscal/core/input_protection.hpp"
#include "axiscal/core/json_document.hpp"
#include "axiscal/core/number_text.hpp"
#include "axiscal/core/output_file.hpp"
#include "axiscal/core/timestamp.hpp"
#include "axiscal/core/units.hpp"
#include "axiscal/core/version.hpp"
#include "axiscal/logs/noise_json.hpp"
#include "axiscal/report/calibration_report.hpp"
#include "commands.hpp"
#include "experiment_options.hpp"
#include "input.hpp"
#include "summary.hpp"

namespace axiscal::cli {
namespace {

int list_sources(const AcquireCommand& command) {
  const std::vector<FoundSource> found = find_sources();
  if (command.json) {
    Json json = {{"found", Json::array()}, {"kinds", Json::array()}};
    for (const FoundSource& one : found) {
      json["found"].push_back({{"address", one.address}, {"description", one.description}});
    }
    for (const SourceKind& kind : source_kinds()) {
      json["kinds"].push_back({{"scheme", kind.scheme},
                               {"address", kind.address},
                               {"help", kind.help},
                               {"options", kind.options},
                               {"available", kind.available}});
    }
    write_whole_file("-", json_text(json));
    return 0;
  }
  std::string text =
      found.empty() ? "Nothing is connected that announces itself.\n" : "Connected\n";
  for (const FoundSource& one : found) {
    text += fmt::format("  {}\n      {}\n", one.address, one.description);
  }
  text += "\nKinds of sources (--connect)\n";
  for (const SourceKind& kind : source_kinds()) {
    text += fmt::format("  {}{}\n      {}\n", kind.address,
                        kind.available ? "" : "  (not in this build)", kind.help);
  }
  write_whole_file("-", text);
  return 0;
}

std::vector<std::unique_ptr<Source>> open_sources(const AcquireCommand& command) {
  if (command.sources.empty()) {
    throw UsageError(
        "acquire: --connect is needed: serial:/dev/ttyUSB0, tcp://HOST:PORT, sim:, ...; acquire "
        "--list shows what is connected");
  }
  std::vector<std::unique_ptr<Source>> sources;
  for (const std::string& address : command.sources) {
    try {
      sources.push_back(open_source(address));
    } catch (const DomainError& error) {
      throw UsageError(std::string("--connect: ") + error.what());
    }
  }
  return sources;
}

bool is_simulated(const AcquireCommand& command) {
  return !command.sources.empty() && command.sources.front().starts_with("sim:");
}

Experiment experiment_for(const AcquireCommand& command) {
  ExperimentOptions options = command.experiment;
  if (!options.files.empty() && !options.files.front().ends_with(".json")) {
    throw UsageError(
        "acquire: '" + options.files.front() +
        "' is no experiment (.json); a recording is --connect file:" + options.files.front());
  }
  if (is_simulated(command) && options.files.empty()) {
    options.instrument = options.instrument.value_or("accelerometer");
    options.field = options.field.value_or("gravity");
    options.unit = options.unit.value_or(
        command.sources.front().find("sensitivity=") == std::string::npos ? "g" : "V");
  }
  Experiment experiment = make_experiment(options);
  if (!experiment.slot.empty()) {
    if (const std::optional<Mount> mount = experiment.positioner.mount(experiment.slot)) {
      experiment.rotation_sensor_from_positioner = mount->rotation_sensor_from_positioner;
    }
  }
  return experiment;
}

std::vector<RunSheetRow> sheet_for(const AcquireCommand& command) {
  if (!command.plan) {
    return make_sheet(command.sheet);
  }
  InputFile file(*command.plan);
  CsvReader csv = csv_reader_of(file);
  return read_run_sheet(csv);
}

// --noise: the standard deviation of a sample, or what `axiscal noise` wrote of a log at rest.
void set_noise(const AcquireCommand& command, const Instrument& instrument, SessionSetup& setup) {
  if (!command.noise) {
    return;
  }
  const auto m = instrument.axis_count();
  if (const std::optional<double> sd = parse_number(*command.noise)) {
    setup.stillness.noise_sd = Eigen::VectorXd::Constant(m, positive_of("--noise", *command.noise));
    return;
  }
  const LogNoise noise = parse_noise(read_whole_file(*command.noise), *command.noise);
  setup.stillness.noise_sd = Eigen::VectorXd(m);
  double dwell_s = 0.0;
  for (Eigen::Index k = 0; k < m; ++k) {
    const std::string& axis = instrument.axes[static_cast<std::size_t>(k)];
    const auto column = std::find_if(noise.columns.begin(), noise.columns.end(),
                                     [&](const ColumnNoise& one) { return one.name == axis; });
    if (column == noise.columns.end()) {
      throw DataError(*command.noise, "has no column '" + axis + "'");
    }
    setup.stillness.noise_sd(k) =
        column->model.coefficient(NoiseKind::white) * std::sqrt(noise.rate_hz);
    dwell_s = std::max(dwell_s, column->dwell.sensible_s);
  }
  setup.dwell_s = std::clamp(dwell_s, setup.shortest_dwell_s, setup.longest_dwell_s);
}

SessionSetup session_setup(const AcquireCommand& command) {
  SessionSetup setup;
  setup.experiment = experiment_for(command);
  setup.sheet = sheet_for(command);
  set_noise(command, setup.experiment.instrument, setup);
  if (command.window) {
    setup.stillness.window_s = positive_of("--window", *command.window);
  }
  if (command.dwell) {
    setup.dwell_s = positive_of("--dwell", *command.dwell);
  }
  if (command.soak_window) {
    setup.soak_window_s = positive_of("--soak-window", *command.soak_window);
  }
  if (command.soak_tolerance) {
    setup.soak_tolerance = positive_of("--soak-tolerance", *command.soak_tolerance);
  }
  if (command.placement_u) {
    setup.placement_sd_rad = positive_of("--placement-u", *command.placement_u);
  }
  if (command.temperature_column) {
    setup.temperature_channel = *command.temperature_column;
  }
  setup.automatic = !command.manual;
  setup.unattended = command.unattended;
  setup.keep_raw = command.raw;
  return setup;
}

// The files that a session leaves, called after its journal.
struct Outputs {
  std::string journal;
  std::string observations;
  std::string record;
  std::string report;
};

Outputs outputs_of(const AcquireCommand& command) {
  std::string name = command.name.value_or("");
  if (name.empty()) {
    std::string now = timestamp_now();
    std::erase_if(now, [](char c) { return c == '-' || c == ':'; });
    name = "axiscal-" + now;
  }
  const std::string journal = command.resume.value_or(command.journal.value_or(name + ".journal"));
  constexpr std::string_view ending = ".journal";
  if (!command.name && journal.ends_with(ending)) {
    name = journal.substr(0, journal.size() - ending.size());
  } else if (command.resume) {
    name = journal;
  }
  return {.journal = journal,
          .observations = command.output.value_or(name + ".csv"),
          .record = command.record.value_or(name + ".json"),
          .report = command.report.value_or(name + ".html")};
}

Json sheet_json(const std::vector<RunSheetRow>& sheet) {
  Json rows = Json::array();
  for (const RunSheetRow& row : sheet) {
    Json one = {{"run", row.run},
                {"block", row.block},
                {"rest", face_name(row.entry.point.rest())},
                {"fence", face_name(row.entry.point.fence())},
                {"level", row.entry.level}};
    if (row.temperature) {
      one["temperature"] = *row.temperature;
    }
    rows.push_back(std::move(one));
  }
  return rows;
}

// The sheet that a session was begun with.
std::vector<RunSheetRow> sheet_of(const JsonValue& header) {
  std::vector<RunSheetRow> sheet;
  for (const JsonValue& one : header.at("sheet").elements()) {
    const std::optional<Face> rest = parse_face(one.at("rest").text());
    const std::optional<Face> fence = parse_face(one.at("fence").text());
    if (!rest || !fence) {
      one.fail("is no point");
    }
    if (axis_of(*rest) == axis_of(*fence)) {
      one.fail("rest and fence must be faces on two axes");
    }
    RunSheetRow row{.run = one.at("run").integer(),
                    .block = one.at("block").integer(),
                    .entry = {.point = {*rest, *fence}, .level = one.at("level").number()},
                    .temperature = {}};
    if (const std::optional<JsonValue> temperature = one.find("temperature")) {
      row.temperature = temperature->number();
    }
    sheet.push_back(row);
  }
  if (sheet.empty()) {
    header.at("sheet").fail("must have one point or more");
  }
  return sheet;
}

Journal start_journal(const AcquireCommand& command,
                      const SessionSetup& setup,
                      const std::string& path) {
  Journal journal = Journal::create(path);
  const Json header = {{"entry", "session"},
                       {"format", journal_format},
                       {"version", 1},
                       {"created", timestamp_now()},
                       {"software", software_name()},
                       {"directory", std::filesystem::current_path().string()},
                       {"arguments", command.arguments},
                       {"sheet", sheet_json(setup.sheet)}};
  const std::string why = journal.append(header.dump());
  if (!why.empty()) {
    throw OutputError(why);
  }
  return journal;
}

// The command that a journal was begun with; what is said anew wins. Files are written beside the
// journal, or where this call says.
AcquireCommand resumed_command(const AcquireCommand& now, const std::string& header) {
  const JsonValue json = parse_json(header, *now.resume);
  const Command begun = parse_command_line(json.at("arguments").texts());
  const auto* const found = std::get_if<AcquireCommand>(&begun);
  if (found == nullptr) {
    json.at("arguments").fail("is no `axiscal acquire`");
  }
  AcquireCommand command = *found;
  command.resume = now.resume;
  if (!now.sources.empty()) {
    command.sources = now.sources;
  }
  // Where files are written is never taken from a journal, which may be somebody else's.
  command.name = now.name;
  command.output = now.output;
  command.record = now.record;
  command.report = now.report;
  command.plain = now.plain;
  command.json = now.json;
  command.web = now.web;
  command.listen = now.listen;
  command.unattended = now.unattended;
  command.raw = now.raw || command.raw;
  const std::string folder = json.at("directory").text();
  if (std::filesystem::path(folder) != std::filesystem::current_path()) {
    throw UsageError("--resume: the session was begun in '" + folder +
                     "', and its files are named from there: go there first");
  }
  return command;
}

bool reads_standard_input(const AcquireCommand& command) {
  return std::any_of(command.sources.begin(), command.sources.end(), [](const std::string& one) {
    return one == "-" || one.starts_with("-?") || one.starts_with("stdin:");
  });
}

std::string title_of(const SessionSetup& setup) {
  const Instrument& instrument = setup.experiment.instrument;
  return "axiscal acquire: " + instrument.kind +
         (instrument.serial.empty() ? "" : " " + instrument.serial);
}

// A port that somebody else may have: 1 to 65535.
int port_of(const AcquireCommand& command) {
  constexpr int highest = 65535;
  const int port = command.port ? whole_number_of("--port", *command.port, 1) : 0;
  if (port > highest) {
    throw UsageError("--port: up to 65535");
  }
  return port;
}

// The fingerprint tells that the certificate, which no authority knows, is this session's.
void announce_page(const std::string& url, const std::string& fingerprint) {
  if (fingerprint.empty()) {
    std::fprintf(stderr, "open in a browser: %s\n", url.c_str());
    return;
  }
  std::fprintf(stderr,
               "%sopen in a browser (once; the next one gets a new address): %s\n"
               "the browser does not know the certificate; it is this session's if its SHA-256 is\n"
               "  %s\n",
               qr_code(url).c_str(), url.c_str(), fingerprint.c_str());
}

std::unique_ptr<SessionFace> web_face_of(const WebOptions& options) {
  try {
    return make_web_face(options);
  } catch (const DomainError& error) {
    throw UsageError(std::string("acquire: ") + error.what());
  }
}

// On a terminal the whole of it, else lines; the page beside them.
std::vector<std::unique_ptr<SessionFace>> make_faces(const AcquireCommand& command,
                                                     const SessionSetup& setup) {
  std::vector<std::unique_ptr<SessionFace>> faces;
  const bool has_commands = !reads_standard_input(command);
  const bool has_terminal = ::isatty(STDIN_FILENO) == 1 && ::isatty(STDOUT_FILENO) == 1;
  if (command.web || command.listen) {
    // The address goes to stderr: it holds the key.
    faces.push_back(web_face_of({.title = title_of(setup),
                                 .address = command.listen.value_or(""),
                                 .port = port_of(command),
                                 .announce = announce_page}));
  }
  if (command.json) {
    faces.push_back(make_json_face(has_commands));
  } else if (command.plain || !has_terminal || !has_commands || command.web || command.listen) {
    faces.push_back(make_plain_face(has_commands));
  } else {
    faces.push_back(make_terminal_face(title_of(setup)));
  }
  return faces;
}

// Writes the files of a session that has come to its end.
Calibration write_files(const SessionSetup& setup, const Session& session, const Outputs& outputs) {
  const Observations observations = session.observations();
  if (observations.readings.empty()) {
    throw RefusedError("no point was taken");
  }
  write_whole_file(outputs.observations,
                   observations_csv(observations, setup.experiment.instrument.axes));
  if (!session.calibration()) {
    throw RefusedError("the readings are in " + outputs.observations +
                       ", but no calibration follows from them; calibrate says why");
  }
  Calibration calibration = *session.calibration();
  calibration.inputs = {
      {.path = outputs.journal, .sha256 = sha256_of_file(outputs.journal)},
      {.path = outputs.observations, .sha256 = sha256_of_file(outputs.observations)}};
  write_whole_file(outputs.record, calibration_json(calibration));
  ReportOptions options;
  options.observations = &observations;
  if (!setup.experiment.positioner.surface().adjusters_m.empty()) {
    options.table = setup.experiment.positioner.surface();
  }
  write_whole_file(outputs.report, calibration_report(calibration, options));
  return calibration;
}

void print_result(const AcquireCommand& command,
                  const Calibration& calibration,
                  const Outputs& outputs) {
  if (command.json) {
    const Json files = {{"event", "files"},
                        {"status", calibration.status},
                        {"observations", outputs.observations},
                        {"record", outputs.record},
                        {"report", outputs.report},
                        {"journal", outputs.journal}};
    print_result_text(files.dump() + "\n");
  } else {
    print_result_text("\n" + summary_text(calibration) + "\nreadings: " + outputs.observations +
                      "\nrecord: " + outputs.record + "\nreport: " + outputs.report +
                      "\njournal: " + outputs.journal + "\n");
  }
  for (const CalibrationWarning& warning : calibration.warnings) {
    print_remark("warning", warning.message);
  }
}

// What would be refused at the end of a session is refused before it.
void check_outputs(const Outputs& outputs) {
  std::vector<std::filesystem::path> files = {std::filesystem::weakly_canonical(outputs.journal)};
  for (const std::string& output : {outputs.observations, outputs.record, outputs.report}) {
    std::error_code none;
    if (output == "-" || (std::filesystem::exists(output, none) &&
                          !std::filesystem::is_regular_file(output, none))) {
      continue;  // a device or a pipe takes all of them
    }
    forbid_replacing_input(output);
    std::filesystem::path file = std::filesystem::weakly_canonical(output);
    if (std::find(files.begin(), files.end(), file) != files.end()) {
      throw UsageError("acquire: journal, readings, record and report need files of their own; '" +
                       output + "' would be two of them");
    }
    files.push_back(std::move(file));
  }
}

int run_guided(AcquireCommand command) {
  std::vector<std::string> lines;
  std::optional<Journal> journal;
  if (command.resume) {
    journal.emplace(Journal::open(*command.resume, lines));
    command = resumed_command(command, lines.front());
  }
  const Outputs outputs = outputs_of(command);
  SessionSetup setup = session_setup(command);
  if (command.resume) {
    setup.sheet = sheet_of(parse_json(lines.front(), *command.resume));
  }
  std::vector<std::unique_ptr<Source>> sources = open_sources(command);
  check_outputs(outputs);
  if (!journal) {
    journal.emplace(start_journal(command, setup, outputs.journal));
  }
  Session session(setup, *journal);
  if (command.resume) {
    session.restore(lines, *command.resume);
  }
  std::optional<Calibration> calibration;
  {
    SampleFeed feed(std::move(sources));
    const std::vector<std::unique_ptr<SessionFace>> faces = make_faces(command, setup);
    std::vector<SessionFace*> shown;
    for (const std::unique_ptr<SessionFace>& face : faces) {
      shown.push_back(face.get());
    }
    try {
      run_session(session, feed, shown, command.unattended);
    } catch (const DomainError& error) {
      throw UsageError(std::string("acquire: ") + error.what());
    }
    // Before the faces go: a page may wait for its slowest browser.
    if (!session.has_quit()) {
      calibration = write_files(setup, session, outputs);
    }
  }
  if (!calibration) {
    throw RefusedError("stopped with " + std::to_string(session.readings().size()) +
                       " readings; go on with: axiscal acquire --resume " + outputs.journal);
  }
  print_result(command, *calibration, outputs);
  return calibration->status == "refused" ? 1 : 0;
}

std::string health_text(const HealthView& view, const std::string& unit) {
  std::string text = fmt::format("{:<7} field {:.5g} {:.5g} {:.5g} {}, residual {:.3g}",
                                 view.is_still ? "still" : "moving", view.now.field_in_sensor.x(),
                                 view.now.field_in_sensor.y(), view.now.field_in_sensor.z(), unit,
                                 view.now.residual);
  if (view.check) {
    const InSituReading& last = view.check->readings.back();
    text += fmt::format("; reading {}: {:.3g}, limit {:.3g}{}", view.readings, last.residual,
                        last.limit, last.within ? "" : " OUTSIDE");
  }
  return text;
}

Json health_json(const HealthView& view, const Calibration& calibration) {
  Json json = {
      {"still", view.is_still},
      {"field",
       {view.now.field_in_sensor.x(), view.now.field_in_sensor.y(), view.now.field_in_sensor.z()}},
      {"residual", view.now.residual},
      {"readings", view.readings}};
  const InstrumentKind& kind = find_instrument_kind(calibration.instrument.kind);
  for (std::size_t i = 0; i < kind.derived_names.size() && !kind.derives_with_attitude; ++i) {
    json[std::string(kind.derived_names[i])] = view.now.derived.values[i];
  }
  if (view.check) {
    json["drifted"] = view.check->drifted;
    json["p_value"] = view.check->p_value;
    json["residual_rss"] = view.check->rss;
    json["expected_rss"] = view.check->expected_rss;
    json["limit"] = view.check->readings.back().limit;
  }
  return json;
}

// An installed instrument's health, live: a verdict when there are readings enough.
int run_check(const AcquireCommand& command) {
  HealthWatchSetup setup;
  setup.calibration = read_calibration(*command.check);
  const std::string unit = setup.calibration.field.unit;
  setup.dwell_s = command.dwell ? positive_of("--dwell", *command.dwell) : setup.dwell_s;
  if (command.window) {
    setup.stillness.window_s = positive_of("--window", *command.window);
  }
  if (command.temperature_column) {
    setup.temperature_channel = *command.temperature_column;
  }
  const int wanted = command.readings ? whole_number_of("--readings", *command.readings, 1) : 3;
  constexpr double usual_patience_s = 60.0;
  const double patience_s =
      command.within ? positive_of("--within", *command.within) : usual_patience_s;
  const Calibration calibration = setup.calibration;
  SampleFeed feed(open_sources(command));
  HealthWatch watch(std::move(setup));
  SampleBatch batch;
  bool has_channels = false;
  double first_s = 0.0;
  double last_s = 0.0;
  double shown_s = -1.0;
  const auto started = std::chrono::steady_clock::now();
  const auto waited_s = [&] {
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - started).count();
  };
  std::string alarm;
  while (watch.view().readings < static_cast<std::size_t>(wanted)) {
    batch.clear();
    constexpr std::chrono::milliseconds patience{50};
    feed.read(batch, patience);
    if (!has_channels && !feed.channels().empty()) {
      try {
        watch.set_channels(feed.channels());
      } catch (const DomainError& error) {
        throw UsageError(std::string("acquire: ") + error.what());
      }
      has_channels = true;
      first_s = batch.size() > 0 ? batch.time_s.front() : 0.0;
    }
    for (std::size_t i = 0; i < batch.size() && has_channels; ++i) {
      watch.add(batch.time_s[i], batch.row(i));
      last_s = batch.time_s[i];
      if (watch.view().readings >= static_cast<std::size_t>(wanted)) {
        break;
      }
    }
    const std::vector<SessionAlarm> alarms = feed.alarms();
    const std::string first_alarm = alarms.empty() ? "" : alarms.front().text;
    if (first_alarm != alarm && !first_alarm.empty()) {
      std::fprintf(stderr, "%s\n", first_alarm.c_str());
    }
    alarm = first_alarm;
    if (last_s - shown_s >= 1.0 && has_channels) {
      shown_s = last_s;
      print_result_text(command.json ? health_json(watch.view(), calibration).dump() + "\n"
                                     : health_text(watch.view(), unit) + "\n");
    }
    if (feed.has_ended() || (feed.is_live() ? waited_s() : last_s - first_s) > patience_s) {
      break;
    }
  }
  const HealthView& view = watch.view();
  if (!view.check) {
    throw RefusedError(has_channels ? "the instrument was never at rest long enough for a reading"
                                    : "no sample came" + (alarm.empty() ? "" : ": " + alarm));
  }
  if (command.json) {
    print_result_text(health_json(view, calibration).dump() + "\n");
  } else {
    print_result_text(
        fmt::format("{}: {} readings at rest, residual RSS {:.3g} {}, expected {:.3g} (p = {})\n",
                    view.check->drifted ? "drifted" : "no drift", view.readings, view.check->rss,
                    unit, view.check->expected_rss, number_text(view.check->p_value, 2)));
  }
  return view.check->drifted ? 1 : 0;
}

}  // namespace

int run(const AcquireCommand& command) {
  if (command.list) {
    return list_sources(command);
  }
  return command.check ? run_check(command) : run_guided(command);
}

}  // namespace axiscal::cli
