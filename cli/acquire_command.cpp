// SPDX-License-Identifier: Apache-2.0
#include "acquire_command.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <exception>
#include <filesystem>

#include <unistd.h>

#include "axiscal/acquisition/assembly_session.hpp"
#include "axiscal/acquisition/free_session.hpp"
#include "axiscal/acquisition/journal.hpp"
#include "axiscal/acquisition/open_source.hpp"
#include "axiscal/acquisition/sample_feed.hpp"
#include "axiscal/acquisition/session.hpp"
#include "axiscal/acquisition/session_face.hpp"
#include "axiscal/acquisition/session_header.hpp"
#include "axiscal/acquisition/web_face.hpp"
#include "axiscal/calib/assembly.hpp"
#include "axiscal/calib/calibration_json.hpp"
#include "axiscal/calib/experiment_json.hpp"
#include "axiscal/core/error.hpp"
#include "axiscal/core/input_file.hpp"
#include "axiscal/core/input_protection.hpp"
#include "axiscal/core/number_text.hpp"
#include "axiscal/core/output_file.hpp"
#include "axiscal/core/printable_text.hpp"
#include "axiscal/core/timestamp.hpp"
#include "axiscal/core/units.hpp"
#include "axiscal/exchange/export.hpp"
#include "axiscal/logs/noise_json.hpp"
#include "axiscal/report/calibration_report.hpp"
#include "axiscal/report/certificate.hpp"
#include "core/formatted.hpp"
#include "core/json_document.hpp"
#include "input.hpp"
#include "log_input.hpp"
#include "run_input.hpp"
#include "sheet_options.hpp"
#include "summary.hpp"
#include "typed_values.hpp"

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
  std::string text = found.empty() ? "No connected device was found.\n" : "Connected\n";
  for (const FoundSource& one : found) {
    text += formatted("  {}\n      {}\n", one.address, one.description);
  }
  text += "\nKinds of sources (--connect)\n";
  for (const SourceKind& kind : source_kinds()) {
    text += formatted("  {}{}\n      {}\n", kind.address,
                      kind.available ? "" : "  (not in this build)", kind.help);
  }
  write_whole_file("-", text);
  return 0;
}

bool is_simulated(const AcquireCommand& command) {
  return !command.sources.empty() && command.sources.front().starts_with("sim:");
}

// Returns the default slot names of an assembly. A slot is the place of one instrument. The list is
// empty if the assembly has no default names.
std::vector<std::string> usual_slots(const std::string& assembly) {
  if (assembly.starts_with("h")) {
    return {"L", "R"};
  }
  return assembly == "triple" ? std::vector<std::string>{"A", "B", "C"}
                              : std::vector<std::string>();
}

// Returns the slots of the session's instruments, which --slot A,B,.. states. Without this option,
// returns the default slots of the assembly, or an empty list without --assembly.
std::vector<std::string> slots_asked_for(const ExperimentOptions& options) {
  std::vector<std::string> slots;
  if (options.slot) {
    slots = names_of(*options.slot);
  } else if (options.assembly) {
    slots = usual_slots(*options.assembly);
    if (slots.empty()) {
      throw UsageError(formatted(
          "acquire: --assembly {}: name the slots of the instruments with --slot A,B,..; the "
          "channels of slot A are then A.x, A.y, ...",
          *options.assembly));
    }
  }
  return slots;
}

// Returns the default slots of the assembly, for a session of one instrument. If they do not
// contain the slot of the instrument, returns only that slot.
std::vector<std::string> all_slots_of(const ExperimentOptions& options,
                                      const Experiment& experiment) {
  std::vector<std::string> slots = usual_slots(options.assembly.value_or(""));
  if (std::find(slots.begin(), slots.end(), experiment.slot) == slots.end()) {
    slots = {experiment.slot};
  }
  return slots;
}

Experiment experiment_for(const AcquireCommand& command) {
  ExperimentOptions options = command.experiment;
  if (!options.files.empty() && !options.files.front().ends_with(".json")) {
    throw UsageError(formatted(
        "acquire: '{}' is not an experiment (.json); for a recording use --connect file:{}",
        options.files.front(), options.files.front()));
  }
  if (is_simulated(command) && options.files.empty()) {
    options.instrument = options.instrument.value_or("accelerometer");
    options.field = options.field.value_or("gravity");
    options.unit = options.unit.value_or(
        command.sources.front().find("sensitivity=") == std::string::npos ? "g" : "V");
  }
  if (states_slots(options)) {
    throw UsageError(
        "acquire: all instruments of a session must be of one kind; to calibrate several kinds, "
        "record the readings with other software, and run `calibrate` on the recorded table");
  }
  Experiment experiment = make_experiment(options);
  const std::vector<std::string> slots = slots_asked_for(options);
  if (slots.size() > 1) {
    experiment.positioner = with_assembly(experiment.positioner, options.assembly, slots);
    return assembled(std::move(experiment), slots);
  }
  if (!experiment.slot.empty()) {
    experiment.positioner =
        with_assembly(experiment.positioner, options.assembly, all_slots_of(options, experiment));
    experiment.rotation_sensor_from_positioner =
        mount_rotation(experiment.positioner, experiment.slot);
  }
  return experiment;
}

std::vector<RunSheetRow> sheet_for(const AcquireCommand& command) {
  return command.plan ? read_sheet_file(*command.plan) : make_sheet(command.sheet);
}

// Applies the option --noise. Its value is the standard deviation of the noise of one sample, or
// the name of a file that `axiscal noise --json` wrote.
void set_noise(const AcquireCommand& command, const Instrument& instrument, SessionSetup& setup) {
  if (!command.noise) {
    return;
  }
  const auto m = instrument.axis_count();
  if (const std::optional<double> sd = parse_number(*command.noise)) {
    setup.stillness.noise_sd =
        Eigen::VectorXd::Constant(m, parse_positive("--noise", *command.noise));
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
      throw DataError(*command.noise, formatted("the column '{}' is missing", axis));
    }
    setup.stillness.noise_sd(k) =
        column->model.coefficient(NoiseKind::white) * std::sqrt(noise.rate_hz);
    dwell_s = std::max(dwell_s, column->dwell.sensible_s);
  }
  setup.dwell_s = std::clamp(dwell_s, setup.shortest_dwell_s, setup.longest_dwell_s);
}

void set_stillness(const AcquireCommand& command, SessionSetup& setup) {
  if (command.window) {
    setup.stillness.window_s = parse_positive("--window", *command.window);
  }
  if (command.dwell) {
    setup.dwell_s = parse_positive("--dwell", *command.dwell);
  }
}

// Makes the setup of a session from the options.
// @param begun  journal header of a resumed session, which states the experiment and the run sheet;
//               nullopt for a new session.
SessionSetup session_setup(const AcquireCommand& command,
                           const std::optional<SessionHeader>& begun) {
  SessionSetup setup;
  setup.experiment = begun && !begun->experiment.empty()
                         ? parse_experiment(begun->experiment, *command.resume).experiment
                         : experiment_for(command);
  setup.sheet = begun          ? begun->sheet
                : command.free ? std::vector<RunSheetRow>()
                               : sheet_for(command);
  set_noise(command, setup.experiment.instrument, setup);
  set_stillness(command, setup);
  if (command.soak_window) {
    setup.soak_window_s = parse_positive("--soak-window", *command.soak_window);
  }
  if (command.soak_tolerance) {
    setup.soak_tolerance = parse_positive("--soak-tolerance", *command.soak_tolerance);
  }
  if (command.placement_u) {
    setup.placement_sd_rad = parse_positive("--placement-u", *command.placement_u);
  }
  if (command.temperature_column) {
    setup.temperature_channels = names_of(*command.temperature_column);
  }
  setup.automatic = !command.manual;
  setup.unattended = command.unattended;
  setup.keep_raw = command.raw;
  return setup;
}

// Converts the setup of a session with a cube to the setup of a session with --free, in which the
// instrument is turned by hand.
FreeSetup free_setup(const AcquireCommand& command, const SessionSetup& of) {
  FreeSetup setup{.experiment = of.experiment, .stillness = of.stillness};
  const std::string& kind = of.experiment.instrument.kind;
  if (kind == "gyroscope") {
    throw UsageError(
        "acquire: --free: the field of a gyroscope that is turned by hand is unknown; record turns "
        "between rests, and run `calibrate --imu`");
  }
  if (of.experiment.instrument.axis_count() != 3) {
    throw UsageError("acquire: --free requires one instrument with three axes");
  }
  if (command.manual || command.plan || command.raw) {
    throw UsageError("acquire: --free cannot be combined with --plan, --manual or --raw");
  }
  // Motion by hand disturbs an accelerometer, so only periods at rest become readings.
  setup.by_rests = kind == "accelerometer" || kind == "inclinometer";
  setup.dwell_s = of.dwell_s.value_or(setup.dwell_s);
  if (command.enough_deg) {
    setup.wanted_u_deg = parse_positive("--enough-deg", *command.enough_deg);
  }
  setup.unattended = command.unattended;
  return setup;
}

constexpr std::string_view slot_place = "{slot}";

// Returns the path with {slot} replaced by the name of the slot.
std::string of_slot(std::string path, const std::string& slot) {
  const std::size_t at = path.find(slot_place);
  return at == std::string::npos ? path : path.replace(at, slot_place.size(), slot);
}

// The names of the output files of a session. By default they all begin with the same name. If
// there are several instruments, the names of record and report contain {slot}.
struct Outputs {
  std::string journal;
  std::string observations;
  std::string record;
  std::string report;
};

// Returns the output files according to the options.
// @param slots  slots of the session; empty for one instrument.
Outputs outputs_of(const AcquireCommand& command, const std::vector<SlotColumns>& slots) {
  const std::string many = slots.empty() ? "" : "-{slot}";
  for (const std::optional<std::string>& file :
       {command.record, command.output, command.report, command.journal}) {
    // Record and report have one file per slot.
    const bool is_own = file == command.record || file == command.report;
    const bool has_slot = file && file->find(slot_place) != std::string::npos;
    if (file && file->find('{') != std::string::npos && (slots.empty() || !is_own || !has_slot)) {
      throw UsageError(formatted(
          "acquire: '{}': {{slot}} may be used only in --record and --report, and only in a "
          "session of several instruments (--assembly); {{serial}} may be used only in `calibrate`",
          *file));
    }
    if (file && is_own && !slots.empty() && !has_slot && *file != "-") {
      throw UsageError(formatted(
          "acquire: '{}': the session has {} instruments; the file name must contain {{slot}}",
          *file, slots.size()));
    }
  }
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
  } else if (!command.name && command.resume) {
    name = journal;
  }
  return {.journal = journal,
          .observations = command.output.value_or(name + ".csv"),
          .record = command.record.value_or(name + many + ".json"),
          .report = command.report.value_or(name + many + ".html")};
}

Journal start_journal(const AcquireCommand& command,
                      const SessionSetup& setup,
                      const std::string& path) {
  Journal journal = Journal::create(path);
  const std::string why = journal.append(session_header_line(
      {.directory = std::filesystem::current_path().string(),
       .arguments = command.arguments,
       .sheet = setup.sheet,
       .free = command.free,
       .experiment = can_be_stated(setup.experiment) ? experiment_json(setup.experiment) : ""}));
  if (!why.empty()) {
    throw OutputError(why);
  }
  return journal;
}

// Returns the arguments as a command line for a shell, quoted if needed.
std::string typed_again(const std::vector<std::string>& arguments) {
  std::vector<std::string> quoted;
  for (const std::string& one : arguments) {
    const bool plain = !one.empty() && one.find_first_not_of(
                                           "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ"
                                           "0123456789-_./:,=+@%") == std::string::npos;
    std::string safe = one;
    for (std::size_t at = safe.find('\''); at != std::string::npos; at = safe.find('\'', at + 4)) {
      safe.replace(at, 1, "'\\''");
    }
    quoted.push_back(plain ? one : formatted("'{}'", safe));
  }
  return joined(quoted, " ");
}

// Returns true if it is safe to open a source that an untrusted journal names. Only standard input
// and simulations are safe.
bool is_harmless(const std::string& source) {
  return source == "-" || source.starts_with("-?") || source.starts_with("stdin:") ||
         source.starts_with("sim:");
}

std::string typed_connections(const std::vector<std::string>& sources) {
  std::string text;
  for (const std::string& source : sources) {
    text += " --connect " + typed_again({source});
  }
  return text;
}

// Asks the user whether the addresses in a journal may be opened.
// @throws UsageError  if standard input is not a terminal, or the answer is not yes.
void require_trust(const std::vector<std::string>& sources, const std::string& journal) {
  if (std::all_of(sources.begin(), sources.end(), is_harmless)) {
    return;
  }
  std::fprintf(stderr, "the journal %s names these sources:\n", printable_name(journal).c_str());
  for (const std::string& source : sources) {
    std::fprintf(stderr, "  %s\n", printable_name(source).c_str());
  }
  if (::isatty(STDIN_FILENO) == 1) {
    std::fputs("Open them? [y/N] ", stderr);
    std::array<char, 64> answer{};
    if (std::fgets(answer.data(), answer.size(), stdin) != nullptr &&
        (answer[0] == 'y' || answer[0] == 'Y')) {
      return;
    }
  }
  throw UsageError(formatted(
      "--resume: the sources in a journal are opened only if you give them again on the command "
      "line: axiscal acquire --resume {}{}",
      typed_again({journal}), typed_connections(sources)));
}

// Returns the command that continues the session of a journal. It has the options in the journal,
// but options of this call take precedence. The output files are placed next to the journal, unless
// the options of this call name other files.
AcquireCommand resumed_command(const AcquireCommand& now, const SessionHeader& header) {
  AcquireCommand command = parse_acquire_command(header.arguments, *now.resume);
  command.resume = now.resume;
  if (!now.sources.empty()) {
    command.sources = now.sources;
  } else {
    require_trust(command.sources, *now.resume);
  }
  // Output file names are never taken from a journal, because another person may have written it.
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
  if (std::filesystem::path(header.directory) != std::filesystem::current_path()) {
    throw UsageError(
        formatted("--resume: the session was started in the folder '{}', and its file names are "
                  "relative to this folder; change to it first",
                  header.directory));
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
  const std::size_t slots = slots_of(instrument).size();
  return formatted("axiscal acquire: {}{}{}", slots > 0 ? formatted("{} times ", slots) : "",
                   instrument.kind, instrument.serial.empty() ? "" : " " + instrument.serial);
}

// Returns the port of --port (1 to 65535), or 0 without this option.
int port_of(const AcquireCommand& command) {
  constexpr int highest = 65535;
  const int port = command.port ? parse_whole_number("--port", *command.port, 1) : 0;
  if (port > highest) {
    throw UsageError("--port: must be 65535 or less");
  }
  return port;
}

// Prints the address of the web page.
// @param fingerprint  fingerprint of the session's self-signed certificate; empty if there is none.
void announce_page(const std::string& url, const std::string& fingerprint) {
  if (fingerprint.empty()) {
    std::fprintf(stderr, "open in a browser: %s\n", url.c_str());
    return;
  }
  std::fprintf(stderr,
               "%sopen in a browser (this address works only once, then a new one is printed): %s\n"
               "the browser warns about an unknown certificate; accept the certificate only if its "
               "SHA-256 is\n  %s\n",
               qr_code(url).c_str(), url.c_str(), fingerprint.c_str());
}

std::unique_ptr<SessionFace> web_face_of(const WebOptions& options) {
  try {
    return make_web_face(options);
  } catch (const DomainError& error) {
    throw UsageError("acquire", error);
  }
}

// Makes the user interfaces of a session. There is a full-screen interface if a terminal is
// present, otherwise lines of text. The web page is added if an option requests it.
std::vector<std::unique_ptr<SessionFace>> make_faces(const AcquireCommand& command,
                                                     const SessionSetup& setup) {
  std::vector<std::unique_ptr<SessionFace>> faces;
  const bool has_commands = !reads_standard_input(command);
  const bool has_terminal = ::isatty(STDIN_FILENO) == 1 && ::isatty(STDOUT_FILENO) == 1;
  if (command.web || command.listen) {
    // The address contains the key, so announce_page() prints it to standard error.
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

// The results of a session: its calibrations, and the files that the web page offers for download.
struct Written {
  std::vector<Calibration> calibrations;
  std::vector<SessionFile> files;
};

std::string name_of_file(const std::string& path) {
  return std::filesystem::path(path).filename().string();
}

// Adds the certificate and the C header of one instrument to the files that the web page offers.
void add_offers(const Calibration& calibration,
                const std::string& record,
                const std::string& of,
                std::vector<SessionFile>& files) {
  const std::string stem = std::filesystem::path(record).stem().string();
  try {
    files.push_back({.name = stem + ".pdf",
                     .label = "Certificate (draft)" + of,
                     .type = "application/pdf",
                     .body = certificate_pdf(calibration, {})});
  } catch (const Error&) {
    // A refused record has no certificate, and a build without cairo cannot make certificates.
  }
  try {
    files.push_back({.name = stem + ".h",
                     .label = "C header" + of,
                     .type = "text/plain; charset=utf-8",
                     .body = export_calibration(calibration, "c-header", {}).content});
  } catch (const Error&) {
    // A refused calibration cannot be exported.
  }
}

// Writes the output files of a finished session.
Written write_files(const SessionSetup& setup, const LiveSession& session, const Outputs& outputs) {
  const Observations observations = session.observations();
  if (observations.readings.empty()) {
    throw RefusedError("the session has no readings");
  }
  const std::string readings = observations_csv(observations, setup.experiment.instrument.axes);
  write_whole_file(outputs.observations, readings);
  if (session.calibrations().empty()) {
    throw RefusedError(
        formatted("the readings are in {}, but no calibration could be computed from these "
                  "readings; run `axiscal calibrate` on this file to see the reason",
                  outputs.observations));
  }
  Written written{.calibrations = session.calibrations()};
  for (Calibration& calibration : written.calibrations) {
    const std::string& slot = calibration.provenance.slot;
    const std::string of = slot.empty() ? "" : ", slot " + slot;
    calibration.provenance.inputs = {
        {.path = outputs.journal, .sha256 = sha256_of_file(outputs.journal)},
        {.path = outputs.observations, .sha256 = sha256_of_file(outputs.observations)}};
    ReportOptions options;
    if (written.calibrations.size() == 1) {
      options.observations = &observations;
    }
    if (!setup.experiment.positioner.surface().adjusters_m.empty()) {
      options.table = setup.experiment.positioner.surface();
    }
    const std::string record = of_slot(outputs.record, slot);
    const std::string report = of_slot(outputs.report, slot);
    const std::string json = calibration_json(calibration);
    const std::string page = calibration_report(calibration, options);
    write_whole_file(record, json);
    write_whole_file(report, page);
    written.files.push_back({.name = name_of_file(report),
                             .label = "Report" + of,
                             .type = "text/html; charset=utf-8",
                             .body = page});
    add_offers(calibration, record, of, written.files);
    written.files.push_back({.name = name_of_file(record),
                             .label = "Record" + of,
                             .type = "application/json",
                             .body = json});
  }
  written.files.push_back({.name = name_of_file(outputs.observations),
                           .label = "Readings",
                           .type = "text/csv; charset=utf-8",
                           .body = readings});
  return written;
}

void print_result(const AcquireCommand& command,
                  const Calibration& calibration,
                  const Outputs& all) {
  const std::string& slot = calibration.provenance.slot;
  Outputs outputs = all;
  outputs.record = of_slot(all.record, slot);
  outputs.report = of_slot(all.report, slot);
  if (command.json) {
    Json files = {{"event", "files"},
                  {"status", status_name(calibration.findings.status)},
                  {"observations", outputs.observations},
                  {"record", outputs.record},
                  {"report", outputs.report},
                  {"journal", outputs.journal}};
    if (!slot.empty()) {
      files["slot"] = slot;
    }
    print_result_text(files.dump() + "\n");
  } else {
    print_result_text(
        formatted("\n{}\nreadings: {}\nrecord: {}\nreport: {}\njournal: {}\n"
                  "certificate: axiscal report {} --laboratory lab.json -o certificate.pdf\n"
                  "export: axiscal export {} --format c-header\n",
                  summary(calibration, SummaryDetail::brief, SummaryEnd::fit), outputs.observations,
                  outputs.record, outputs.report, outputs.journal, typed_again({outputs.record}),
                  typed_again({outputs.record})));
    // The command is printed only if no option names an output file. If an option names one, that
    // file now exists, so the same command would be refused.
    if (!command.name && !command.journal && !command.output && !command.record &&
        !command.report && !command.resume) {
      print_result_text(formatted("again: axiscal {}\n", typed_again(command.arguments)));
    }
  }
  for (const CalibrationWarning& warning : calibration.findings.warnings) {
    print_remark("warning", warning.message);
  }
}

// Checks the output files before the session starts, because an error at the end would lose the
// results.
void check_outputs(const Outputs& outputs, const std::vector<SlotColumns>& slots) {
  std::vector<std::filesystem::path> files = {std::filesystem::weakly_canonical(outputs.journal)};
  std::vector<std::string> all = {outputs.observations};
  for (const SlotColumns& slot : slots) {
    all.push_back(of_slot(outputs.record, slot.slot));
    all.push_back(of_slot(outputs.report, slot.slot));
  }
  if (slots.empty()) {
    all.insert(all.end(), {outputs.record, outputs.report});
  }
  for (const std::string& output : all) {
    std::error_code none;
    if (output == "-" || (std::filesystem::exists(output, none) &&
                          !std::filesystem::is_regular_file(output, none))) {
      continue;  // outputs may share a device or a pipe
    }
    forbid_replacing_input(output);
    std::filesystem::path file = std::filesystem::weakly_canonical(output);
    if (std::find(files.begin(), files.end(), file) != files.end()) {
      throw UsageError(
          formatted("acquire: journal, readings, record and report must be different files; '{}' "
                    "is named twice",
                    output));
    }
    files.push_back(std::move(file));
  }
}

using Faces = std::vector<std::unique_ptr<SessionFace>>;

// Runs one session after another with the same user interfaces.
class Guided {
 public:
  explicit Guided(AcquireCommand command) : command_(std::move(command)) {}

  int run() {
    std::exception_ptr failure;
    bool again = true;
    for (int number = 1; again; ++number) {
      try {
        again = run_one(number);
      } catch (...) {
        failure = std::current_exception();  // thrown again after the results are printed
        again = false;
      }
    }
    faces_.clear();  // restores the terminal before the results are printed
    bool refused = false;
    for (const auto& [calibrations, outputs] : results_) {
      for (const Calibration& calibration : calibrations) {
        print_result(command_, calibration, outputs);
        refused = refused || calibration.findings.status == CalibrationStatus::refused;
      }
    }
    if (failure) {
      std::rethrow_exception(failure);
    }
    if (!stopped_.empty()) {
      throw RefusedError(stopped_);
    }
    return refused ? 1 : 0;
  }

 private:
  // Runs one session. @return true if the user requests another session.
  bool run_one(int number) {
    std::vector<std::string> lines;
    std::optional<Journal> journal;
    std::optional<SessionHeader> begun;
    if (command_.resume && number == 1) {
      journal.emplace(Journal::open(*command_.resume, lines));
      begun = parse_session_header(lines.front(), *command_.resume);
      command_ = resumed_command(command_, *begun);
    }
    SessionSetup setup = session_setup(command_, begun);
    const std::vector<SlotColumns> slots = slots_of(setup.experiment.instrument);
    Outputs outputs = outputs_of(command_, slots);
    if (number > 1) {
      outputs = numbered(outputs, number);
    }
    std::vector<std::unique_ptr<Source>> sources = open_sources(command_);
    std::optional<FreeSetup> free;
    if (command_.free) {
      free = free_setup(command_, setup);
    } else if (command_.enough_deg) {
      throw UsageError("acquire: --enough-deg requires --free");
    }
    for (const std::unique_ptr<Source>& source : sources) {
      source->play(setup.experiment);
      if (free) {
        source->set_free_motion(free->by_rests);
      }
    }
    check_outputs(outputs, slots);
    if (!journal) {
      journal.emplace(start_journal(command_, setup, outputs.journal));
    }
    const std::unique_ptr<LiveSession> live =
        free ? std::unique_ptr<LiveSession>(std::make_unique<FreeSession>(*free, *journal))
             : std::make_unique<Session>(setup, *journal);
    LiveSession& session = *live;
    if (!lines.empty()) {
      session.restore(lines, *command_.resume);
    }
    SampleFeed feed(std::move(sources));
    if (faces_.empty()) {
      faces_ = make_faces(command_, setup);
    }
    std::vector<SessionFace*> shown;
    for (const std::unique_ptr<SessionFace>& face : faces_) {
      shown.push_back(face.get());
    }
    try {
      run_session(session, feed, shown, command_.unattended,
                  [&] { store_at_review(setup, session, outputs); });
    } catch (const DomainError& error) {
      throw UsageError("acquire", error);
    }
    if (session.has_quit()) {
      const bool asks = !std::all_of(command_.sources.begin(), command_.sources.end(), is_harmless);
      stopped_ = formatted("stopped with {} readings; to continue: axiscal acquire --resume {}{}",
                           session.view().done, typed_again({outputs.journal}),
                           asks ? typed_connections(command_.sources) : "");
      return false;
    }
    // The files are written before conclude(), which may wait for a slow browser.
    Written written = write_files(setup, session, outputs);
    results_.emplace_back(std::move(written.calibrations), outputs);
    bool again = false;
    for (SessionFace* const face : command_.unattended ? std::vector<SessionFace*>() : shown) {
      again = face->conclude(session.view(), written.files) || again;
    }
    return again;
  }

  // Writes the output files when the final review of a session starts, because the user may never
  // finish that review.
  static void store_at_review(const SessionSetup& setup,
                              const LiveSession& session,
                              const Outputs& outputs) {
    for (const std::string* path : {&outputs.observations, &outputs.record, &outputs.report}) {
      if (*path == "-") {
        return;  // text written to stdout cannot be replaced later
      }
    }
    try {
      static_cast<void>(write_files(setup, session, outputs));
    } catch (const Error&) {
      // write_files() runs again at the end of the session and then reports this error.
    }
    for (const std::string* path : {&outputs.observations, &outputs.record, &outputs.report}) {
      allow_rewriting(*path);
    }
  }

  // Returns the output files of a further session. Its number is added to the names, for example
  // NAME-2.json.
  static Outputs numbered(const Outputs& first, int number) {
    const auto name = [number](const std::string& path) {
      const std::filesystem::path whole(path);
      const std::filesystem::path file(
          formatted("{}-{}{}", whole.stem().string(), number, whole.extension().string()));
      return path == "-" ? path : (whole.parent_path() / file).string();
    };
    return {.journal = name(first.journal),
            .observations = name(first.observations),
            .record = name(first.record),
            .report = name(first.report)};
  }

  AcquireCommand command_;
  Faces faces_;
  std::vector<std::pair<std::vector<Calibration>, Outputs>> results_;
  std::string stopped_;  // message about a stopped session; otherwise empty
};

}  // namespace

std::vector<std::unique_ptr<Source>> open_sources(const AcquireCommand& command) {
  if (command.sources.empty()) {
    throw UsageError(
        "acquire: give the address of the instrument with --connect, for example "
        "serial:/dev/ttyUSB0, tcp://HOST:PORT or sim:; `acquire --list` shows the connected "
        "devices");
  }
  std::vector<std::unique_ptr<Source>> sources;
  for (const std::string& address : command.sources) {
    try {
      sources.push_back(open_source(address));
    } catch (const DomainError& error) {
      throw UsageError("--connect", error);
    }
  }
  return sources;
}

int run_acquire(const AcquireCommand& command) {
  if (command.list) {
    return list_sources(command);
  }
  return command.check ? run_health_check(command) : Guided(command).run();
}

}  // namespace axiscal::cli
