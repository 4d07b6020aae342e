// SPDX-License-Identifier: Apache-2.0
// A libFuzzer target for each reader of outside data. For any bytes a reader returns or throws an
// Axiscal error. There is one program, and its name selects the target (fuzz_record); `axiscal_fuzz
// --list` lists the targets. scripts/fuzz.sh runs them.
#include <algorithm>
#include <array>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <optional>
#include <string>
#include <string_view>

#include <fcntl.h>
#include <sys/mman.h>
#include <unistd.h>

#include "acquisition/src/decoder.hpp"
#include "acquisition/src/web_page.hpp"
#include "acquisition/src/web_request.hpp"
#include "axiscal/acquisition/journal.hpp"
#include "axiscal/acquisition/session.hpp"
#include "axiscal/calib/body.hpp"
#include "axiscal/calib/calibrate.hpp"
#include "axiscal/calib/calibration_json.hpp"
#include "axiscal/calib/certificate_details.hpp"
#include "axiscal/calib/experiment_json.hpp"
#include "axiscal/calib/limits.hpp"
#include "axiscal/calib/observations_csv.hpp"
#include "axiscal/calib/reduction_csv.hpp"
#include "axiscal/calib/study.hpp"
#include "axiscal/core/error.hpp"
#include "axiscal/core/number_text.hpp"
#include "axiscal/exchange/import.hpp"
#include "axiscal/logs/log_file.hpp"
#include "axiscal/logs/noise_json.hpp"
#include "axiscal/logs/recording_file.hpp"
#include "axiscal/logs/segment.hpp"
#include "axiscal/logs/table_text.hpp"
#include "axiscal/positioner/positioner_json.hpp"
#include "exchange_options.hpp"
#include "run_command.hpp"
#include "structured.hpp"
#include "subcommands.hpp"

namespace {

using namespace axiscal;  // NOLINT(google-build-using-namespace): one file of calls

// A temporary file with these bytes, for readers that need a path.
class File {
 public:
  explicit File(std::string_view bytes) : descriptor_(::memfd_create("fuzz", MFD_CLOEXEC)) {
    while (!bytes.empty()) {
      const ssize_t count = ::write(descriptor_, bytes.data(), bytes.size());
      if (count <= 0) {
        std::abort();
      }
      bytes.remove_prefix(static_cast<std::size_t>(count));
    }
  }
  File(const File&) = delete;
  File& operator=(const File&) = delete;
  ~File() { ::close(descriptor_); }

  [[nodiscard]] std::string path() const { return "/proc/self/fd/" + std::to_string(descriptor_); }

 private:
  int descriptor_;
};

CsvReader csv_of(std::string_view bytes) {
  return {[rest = bytes](char* buffer, std::size_t size) mutable {
            const std::size_t count = rest.copy(buffer, size);
            rest.remove_prefix(count);
            return count;
          },
          "input.csv"};
}

void expect_that_it_can_be_read_back(const Calibration& calibration) {
  static_cast<void>(parse_calibration(calibration_json(calibration), "record"));
}

void observations(std::string_view bytes) {
  CsvReader csv = csv_of(bytes);
  static_cast<void>(read_observations(csv, {}));
}

void calibrated(std::string_view bytes) {
  CsvReader csv = csv_of(bytes);
  const Observations readings = read_observations(csv, {}).observations;
  if (readings.size() > 30) {
    return;
  }
  Experiment experiment;
  experiment.fit.search_for_mistakes = false;  // takes seconds with a sanitizer
  experiment.instrument.kind = "accelerometer";
  experiment.field.of = make_field("gravity");
  const Calibration calibration = calibrate(experiment, readings);
  // calibration_json() throws an Axiscal error for values that it cannot write.
  const std::string text = calibration_json(calibration);
  static_cast<void>(parse_calibration(text, "record"));
}

void sheet(std::string_view bytes) {
  CsvReader csv = csv_of(bytes);
  static_cast<void>(run_sheet_csv(read_run_sheet(csv)));
}

void record(std::string_view bytes) {
  expect_that_it_can_be_read_back(parse_calibration(bytes, "record.json"));
}

void experiment(std::string_view bytes) {
  // Experiments that name other files are skipped.
  for (const std::string_view key : {"\"positioner\"", "\"from\""}) {
    if (bytes.find(key) != std::string_view::npos) {
      return;
    }
  }
  const Experiment made = parse_experiment(bytes, "experiment.json").experiment;
  static_cast<void>(make_field_description(made));
}

void positioner(std::string_view bytes) {
  const Positioner made = parse_positioner(bytes, "cube.json");
  static_cast<void>(parse_positioner(positioner_json(made), "again"));
}

void rotation(std::string_view bytes) {
  static_cast<void>(parse_body_rotation(bytes, "body.json"));
}

void limits(std::string_view bytes) {
  static_cast<void>(parse_limits(bytes, "limits.json"));
}

void laboratory(std::string_view bytes) {
  static_cast<void>(read_certificate_details(File(bytes).path()));
}

void mapping(std::string_view bytes) {
  static_cast<void>(read_log_format(File(bytes).path()));
}

// A log of any format. Its first bytes select the format.
void log_of(std::string_view bytes) {
  const File file(bytes);
  LogFile log(file.path());
  LogBlock block;
  while (log.read(block, 4096) > 0) {
  }
}

// Adds the format's first bytes, unless the input already begins with them.
std::string with_start(std::string_view start, std::string_view bytes) {
  return bytes.starts_with(start) ? std::string(bytes) : std::string(start) + std::string(bytes);
}

void log_with_start(std::string_view start, std::string_view bytes) {
  log_of(with_start(start, bytes));
}

void npy(std::string_view bytes) {
  log_with_start("\x93NUMPY", bytes);
}

// Reads every series of a recording or a text table.
void recording(std::string_view bytes) {
  const File file(bytes);
  static_cast<void>(recording_json(summarise(file.path(), 100000)));
}

template <const auto& Start>
void recording_of(std::string_view bytes) {
  recording(with_start(Start, bytes));
}

using namespace std::string_view_literals;
constexpr std::string_view ulog_start = "ULog\x01\x12\x35\x01\0\0\0\0\0\0\0\0"sv;
constexpr std::string_view dataflash_start = "\xA3\x95"sv;
constexpr std::string_view rosbag1_start = "#ROSBAG V2.0\n"sv;
constexpr std::string_view mcap_start = "\x89MCAP0\r\n"sv;
constexpr std::string_view blackbox_start =
    "H Product:Blackbox flight data recorder by Nicholas Sherlock\n"sv;
constexpr std::string_view zip_start = "PK\x03\x04"sv;
constexpr std::string_view tlog_start = ""sv;
constexpr std::string_view bag2_start = "SQLite format 3\0"sv;
constexpr std::string_view hdf5_start = "\x89HDF\r\n\x1a\n"sv;
constexpr std::string_view json_start = "["sv;

void table(std::string_view bytes) {
  const File file(bytes);
  TableText text(file.path());
  CsvReader csv = text.reader({"run", "rest", "fence", "x", "y", "z"});
  static_cast<void>(read_observations(csv, {}));
}

void mat(std::string_view bytes) {
  log_with_start("MATLAB 5.0 ", bytes);
}

void mat73(std::string_view bytes) {
  log_with_start("MATLAB 7.3 ", bytes);
}

void gzip(std::string_view bytes) {
  log_with_start("\x1f\x8b", bytes);
}

void segmented(std::string_view bytes) {
  const File file(bytes);
  LogFile log(file.path());
  if (log.columns().size() >= 4) {
    static_cast<void>(segment(log, {.columns = {log.columns()[1]}}));
  }
}

void imported(std::string_view bytes, const char* format) {
  for (const char* const kind : {"accelerometer", "gyroscope", "magnetometer"}) {
    try {
      expect_that_it_can_be_read_back(import_calibration(bytes, "file", format, {.kind = kind}));
    } catch (const Error&) {
    }
  }
}

void px4(std::string_view bytes) {
  imported(bytes, "px4");
}
void ardupilot(std::string_view bytes) {
  imported(bytes, "ardupilot");
}
void kalibr(std::string_view bytes) {
  imported(bytes, "kalibr");
}
void imucal(std::string_view bytes) {
  imported(bytes, "imucal");
}

void decode(Decoder& decoder, std::string_view bytes) {
  const DecoderSink sink{.sample = [](std::span<const double>) {}, .defect = [] {}};
  constexpr std::size_t piece = 31;
  for (std::size_t at = 0; at < bytes.size(); at += piece) {
    decoder.decode(bytes.substr(at, piece), sink);
  }
  decoder.restart(true);
  decoder.decode(bytes, sink);
}

void decode_as(const std::string& options, std::string_view bytes) {
  decode(*make_decoder(parse_source_address("stdin:?" + options, {"stdin"})), bytes);
}

void stream(std::string_view bytes) {
  decode_as("", bytes);
}
void json_stream(std::string_view bytes) {
  decode_as("format=json", bytes);
}
void pattern_stream(std::string_view bytes) {
  decode_as("pattern=x=(?<x>[^;]*);y=(?<y>[^;]*)", bytes);
}

// The first line is the description of the frames; the rest is frames.
void frames(std::string_view bytes) {
  const std::size_t parting = bytes.find('\n');
  const File description(bytes.substr(0, parting));
  const auto decoder = make_frame_decoder(description.path());
  if (parting != std::string_view::npos) {
    decode(*decoder, bytes.substr(parting + 1));
  }
}

SessionSetup setup() {
  SessionSetup made;
  made.experiment.instrument.kind = "accelerometer";
  made.experiment.field.of = make_field("gravity");
  int run = 1;
  for (const DesignEntry& entry : standard_design(12)) {
    made.sheet.push_back({.run = run++, .block = 1, .entry = entry, .temperature = {}});
  }
  return made;
}

void journal(std::string_view bytes) {
  const File file(bytes);
  std::vector<std::string> lines;
  Journal opened = Journal::open(file.path(), lines);
  static const SessionSetup begun = setup();
  Session session(begun, opened);
  session.restore(lines, file.path());
  static_cast<void>(session.observations());
}

void http(std::string_view bytes) {
  static WebPage page({.title = "fuzz",
                       .scheme = "http",
                       .address = "127.0.0.1",
                       .port = 8712,
                       .is_loopback = true,
                       .announce = {}});
  RequestReader reader;
  constexpr std::size_t piece = 61;
  for (std::size_t at = 0; at < bytes.size(); at += piece) {
    const RequestReader::State state = reader.add(bytes.substr(at, piece));
    if (state == RequestReader::State::complete) {
      const WebAnswer answer = page.answer(reader.take());
      if (answer.is_stream) {
        std::abort();  // impossible without the key
      }
      return;
    }
    if (state != RequestReader::State::needs_more) {
      return;
    }
  }
}

Calibration usual_record() {
  Calibration calibration;
  calibration.sensor.instrument.kind = "accelerometer";
  calibration.sensor.field.kind = "gravity";
  calibration.sensor.field.unit = "g";
  calibration.sensor.field.magnitude = 1.0;
  calibration.sensor.response = {.bias = Eigen::Vector3d(0.1, 0.2, 0.3),
                                 .sensitivity = Eigen::Matrix3d::Identity()};
  return calibration;
}

void readings(std::string_view bytes) {
  static const Calibration calibration = usual_record();
  static const Reducer reducer(calibration);
  CsvReader csv = csv_of(bytes);
  static_cast<void>(reduce_csv(csv, reading_columns(calibration.sensor.instrument), reducer, {},
                               [](std::string_view) {}));
}

void noise(std::string_view bytes) {
  static_cast<void>(parse_noise(noise_json(parse_noise(bytes, "noise.json")), "again"));
}

void study(std::string_view bytes) {
  static_cast<void>(parse_study(bytes, "study.json"));
}

// The whole command. The first line is its arguments, separated by blanks, and the rest is the file
// that INPUT names. Sessions and studies are excluded, because they take long.
void command(std::string_view bytes) {
  const std::size_t parting = bytes.find('\n');
  if (parting == std::string_view::npos) {
    return;
  }
  const File file(bytes.substr(parting + 1));
  std::vector<std::string> arguments;
  for (const std::string_view word : split(bytes.substr(0, parting), ' ')) {
    const bool is_path = word.find('/') != std::string_view::npos || word.starts_with("-o");
    if (!is_path && !word.empty()) {
      arguments.push_back(word == "INPUT" ? file.path() : std::string(word));
    }
  }
  static const std::vector<cli::Subcommand> subcommands = {
      cli::field_subcommand(),
      cli::log_subcommand(),
      cli::calibrate_subcommand(),
      cli::segment_subcommand(),
      cli::noise_subcommand(),
      cli::apply_subcommand(),
      cli::level_subcommand(),
      cli::characterize_subcommand(),
      cli::check_subcommand(),
      cli::budget_subcommand(),
      cli::template_subcommand(),
      cli::export_subcommand(&cli::run_export),
      cli::import_subcommand(&cli::run_import)};
  static const bool is_quiet = [] {
    const int nowhere = ::open("/dev/null", O_WRONLY | O_CLOEXEC);
    return ::dup2(nowhere, STDOUT_FILENO) >= 0;
  }();
  const int status = cli::run_command(arguments, subcommands);
  if (!is_quiet || status < 0 || status > 4) {
    std::abort();  // an undocumented exit status
  }
}

struct Target {
  const char* name;
  void (*run)(std::string_view bytes);
};

constexpr std::array targets = {
    Target{"observations", observations},
    Target{"calibrate", calibrated},
    Target{"sheet", sheet},
    Target{"record", record},
    Target{"experiment", experiment},
    Target{"positioner", positioner},
    Target{"limits", limits},
    Target{"rotation", rotation},
    Target{"laboratory", laboratory},
    Target{"mapping", mapping},
    Target{"log", log_of},
    Target{"recording", recording},
    Target{"ulog", recording_of<ulog_start>},
    Target{"dataflash", recording_of<dataflash_start>},
    Target{"rosbag1", recording_of<rosbag1_start>},
    Target{"mcap", recording_of<mcap_start>},
    Target{"blackbox", recording_of<blackbox_start>},
    Target{"zip", recording_of<zip_start>},
    Target{"tlog", recording_of<tlog_start>},
    Target{"rosbag2", recording_of<bag2_start>},
    Target{"hdf5", recording_of<hdf5_start>},
    Target{"json", recording_of<json_start>},
    Target{"command", command},
    Target{"table", table},
    Target{"npy", npy},
    Target{"mat", mat},
    Target{"mat73", mat73},
    Target{"gzip", gzip},
    Target{"segment", segmented},
    Target{"px4", px4},
    Target{"ardupilot", ardupilot},
    Target{"kalibr", kalibr},
    Target{"imucal", imucal},
    Target{"stream", stream},
    Target{"json_stream", json_stream},
    Target{"pattern_stream", pattern_stream},
    Target{"frames", frames},
    Target{"journal", journal},
    Target{"http", http},
    Target{"readings", readings},
    Target{"noise", noise},
    Target{"study", study},
};

const Target* chosen = nullptr;
const fuzz::RecordFormat* format = nullptr;

}  // namespace

extern "C" int LLVMFuzzerInitialize(int* argc, char*** argv) {
  if (*argc > 1 && std::strcmp((*argv)[1], "--list") == 0) {
    for (const Target& target : targets) {
      std::printf("%s\n", target.name);
    }
    std::exit(0);
  }
  const std::string name = (*argv)[0];
  for (const Target& target : targets) {
    if (name.ends_with(std::string("fuzz_") + target.name)) {
      chosen = &target;
    }
  }
  if (chosen == nullptr) {
    std::fprintf(stderr, "call it by a name that ends in fuzz_TARGET (a link); --list has them\n");
    std::exit(2);
  }
  format = fuzz::format_of_target(chosen->name);
  return 0;
}

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  try {
    chosen->run({reinterpret_cast<const char*>(data), size});
  } catch (const axiscal::Error&) {
    // Only Axiscal errors are caught. Any other exception ends the program.
  }
  return 0;
}

extern "C" std::size_t LLVMFuzzerMutate(std::uint8_t* data, std::size_t size, std::size_t max_size);

extern "C" std::size_t LLVMFuzzerCustomMutator(std::uint8_t* data,
                                               std::size_t size,
                                               std::size_t max_size,
                                               unsigned int seed) {
  return format != nullptr ? fuzz::mutate_records(*format, data, size, max_size, seed)
                           : LLVMFuzzerMutate(data, size, max_size);
}
