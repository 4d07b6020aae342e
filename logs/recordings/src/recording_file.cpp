// SPDX-License-Identifier: Apache-2.0
#include "axiscal/logs/recording_file.hpp"

#include <algorithm>
#include <array>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <limits>

#include <fcntl.h>
#include <system_error>
#include <unistd.h>

#include "axiscal/core/error.hpp"
#include "axiscal/core/input_file.hpp"
#include "axiscal/core/number_text.hpp"
#include "axiscal/core/printable_text.hpp"
#include "core/descriptor.hpp"
#include "core/formatted.hpp"
#include "logs/recordings/src/opened.hpp"
#include "logs/recordings/src/text_encoding.hpp"
#include "logs/recordings/src/text_layout.hpp"

namespace axiscal {
namespace {

using namespace std::string_view_literals;

// @return the program that wrote a table, recognised by the names of the columns; "table" if the
//         program is not known.
std::string format_of_table(const std::vector<std::string>& columns) {
  const auto has = [&](std::string_view part) {
    return std::any_of(columns.begin(), columns.end(), [&](const std::string& name) {
      return name.find(part) != std::string::npos;
    });
  };
  const std::string first = columns.empty() ? "" : columns.front();
  const std::string second = columns.size() > 1 ? columns[1] : "";
  return has("loopIteration")                                       ? "blackbox"
         : has("PacketCounter")                                     ? "xsens"
         : has("loggingTime") || has("accelerometerAcceleration")   ? "sensorlog"
         : first == "time" && second == "seconds_elapsed"           ? "sensorlogger"
         : has("seconds_elapsed") && has("sensor")                  ? "sensorlogger"
         : first == "Timestamp (us)" || has("Gyroscope X (deg/s)")  ? "ximu"
         : has("AngleX(deg)") || (first == "address" && has("(g)")) ? "witmotion"
         : first == "Time (s)"                                      ? "phyphox"
                                                                    : "table";
}

OpenedFile table(const char* format,
                 std::unique_ptr<LogFile::Source> source,
                 const std::string& path) {
  for (std::string& column : source->columns) {
    column = printable_name(column);
  }
  OpenedFile opened{.format = format, .table_name = stem_of(path), .table = std::move(source)};
  return opened;
}

OpenedFile decoded(DecoderPointer decoder) {
  OpenedFile opened{.format = decoder->format};
  opened.decoder = std::move(decoder);
  return opened;
}

// Recognises the format of text from its first lines, and opens it.
OpenedFile open_text(ByteSource bytes) {
  bytes = as_utf8(std::move(bytes));
  constexpr std::size_t looked_at = 8192;
  const std::string_view start = bytes.peek(looked_at);
  const bool is_text = start.find('\0') == std::string_view::npos;
  if (is_text && is_dataflash_text(start)) {
    return decoded(open_dataflash_text(std::move(bytes)));
  }
  if (is_text && is_mavlink_text(start)) {
    return decoded(open_mavlink_text(std::move(bytes)));
  }
  if (is_text && is_vectornav(start)) {
    return decoded(open_vectornav(std::move(bytes)));
  }
  if (is_text && is_motioncal(start)) {
    return decoded(open_motioncal(std::move(bytes)));
  }
  const std::size_t content = start.starts_with("\xEF\xBB\xBF") ? 3 : 0;
  const std::size_t first = start.find_first_not_of(" \t\r\n", content);
  if (first != std::string_view::npos && (start[first] == '{' || start[first] == '[') &&
      start.substr(first).find_first_of("\"[") != std::string_view::npos) {
    return open_json(std::move(bytes));
  }
  OpenedFile opened{.table_name = stem_of(bytes.path())};
  opened.text = is_text ? printed_lines_as_table(std::move(bytes)) : std::move(bytes);
  return opened;
}

// @return the paths of the recordings in a folder: its only bag, or its tables (.csv).
std::vector<std::string> files_in_folder(const std::string& path) {
  std::vector<std::string> bags, tables;
  std::error_code none;
  for (const auto& entry : std::filesystem::directory_iterator(path, none)) {
    const std::string name = entry.path().string();
    if (!entry.is_regular_file(none)) {
      continue;  // opening a FIFO would block
    }
    if (name.ends_with(".db3") || name.ends_with(".mcap") || name.ends_with(".db3.zstd") ||
        name.ends_with(".mcap.zstd")) {
      bags.push_back(name);
    } else if (name.ends_with(".csv")) {
      tables.push_back(name);
    }
  }
  std::sort(bags.begin(), bags.end());
  std::sort(tables.begin(), tables.end());
  if (bags.size() > 1) {
    throw DataError(path, "is a directory with several bags; name one of them: " + joined(bags));
  }
  if (bags.empty() && tables.empty()) {
    throw DataError(path,
                    "is a directory that contains neither a ROS 2 bag (.db3, .mcap) nor tables "
                    "(.csv)");
  }
  return bags.empty() ? tables : bags;
}

// Copies the remaining bytes of a ByteSource or an InputFile.
template <typename Bytes>
void copy_rest(Bytes& bytes, SpooledFile& copy) {
  std::vector<char> buffer(1U << 18U);
  while (const std::size_t count = bytes.read(buffer.data(), buffer.size())) {
    copy.write(buffer.data(), count);
  }
}

// @return a budget without a limit on disk space, for copies no larger than their original.
ReadBudget unlimited_disk(const std::string& path) {
  ReadLimits limits;
  limits.set(ReadCost::disk, std::numeric_limits<double>::infinity());
  return ReadBudget(path, limits);
}

// When the name of a temporary copy is removed from its folder: before or after a library opens the
// copy. Libraries that resolve symbolic links, such as SQLite, need the name to open it.
enum class UnlinkTime { before, after };

// Opens a file whose reader needs a regular file. Other bytes, for example those of a pipe, are
// first copied to a temporary file.
template <typename Open>
OpenedFile with_file(ByteSource bytes, UnlinkTime name_goes, const Open& open) {
  const std::string path = bytes.path();
  const ReadBudget budget = bytes.budget();
  if (bytes.is_file()) {
    return open(path, path, budget);
  }
  const auto copy = std::make_shared<SpooledFile>(path, budget);
  copy_rest(bytes, *copy);
  if (name_goes == UnlinkTime::before) {
    copy->remove_name();
  }
  OpenedFile opened = open(copy->path(), path, budget);
  if (name_goes == UnlinkTime::after) {
    copy->remove_name();
  }
  if (opened.decoder) {
    opened.decoder->keep = copy;
  }
  return opened;
}

}  // namespace

std::string_view name_of(SeriesKind kind) {
  constexpr std::array<std::string_view, 5> names = {"accelerometer", "gyroscope", "magnetometer",
                                                     "temperature", "other"};
  return names[static_cast<std::size_t>(kind)];
}

std::string stem_of(const std::string& path) {
  const std::size_t slash = path.find_last_of("/:");
  std::string name = slash == std::string::npos ? path : path.substr(slash + 1);
  const std::size_t point = name.find('.', 1);
  return point == std::string::npos ? name : name.substr(0, point);
}

ByteSource bytes_of_text(const std::string& path, std::string text, const ReadBudget& budget) {
  return {path,
          [text = std::make_shared<const std::string>(std::move(text)), given = std::size_t{0}](
              char* buffer, std::size_t size) mutable {
            const std::size_t count = text->copy(buffer, size, given);
            given += count;
            return count;
          },
          budget};
}

SpooledFile::SpooledFile(std::string name, ReadBudget budget)
    : name_(std::move(name)), budget_(std::move(budget)) {}

void SpooledFile::write(const char* buffer, std::size_t size) {
  budget_.spend(ReadCost::disk, size);
  if (!write_all(file_.descriptor(), {buffer, size})) {
    throw OutputError(
        formatted("{}: a temporary copy cannot be written ({}); set TMPDIR to a folder with free "
                  "space",
                  name_, std::strerror(errno)));
  }
}

struct ReopenableFile::Pipe {
  InputFile file;
  std::shared_ptr<SpooledFile> copy;  // null after disable_reopening()
};

void ReopenableFile::disable_reopening() {
  if (pipe_) {
    pipe_->copy.reset();
  }
}

OpenedFile ReopenableFile::open() {
  std::error_code none;
  if (can_be_read_again(path_) || std::filesystem::is_directory(path_, none)) {
    return open_recording(path_, limits_);
  }
  if (!pipe_) {
    pipe_ = std::shared_ptr<Pipe>(new Pipe{InputFile(path_), nullptr});
    // The copy cannot be larger than the data from the pipe, so its disk space is not limited.
    pipe_->copy = std::make_shared<SpooledFile>(path_, unlimited_disk(path_));
    pipe_->copy->remove_name();
    return open_recording(ByteSource(
        path_,
        [pipe = pipe_](char* buffer, std::size_t size) {
          const std::size_t count = pipe->file.read(buffer, size);
          if (pipe->copy) {
            pipe->copy->write(buffer, count);
          }
          return count;
        },
        limits_));
  }
  copy_rest(pipe_->file, *pipe_->copy);
  return open_recording(ByteSource(
      path_,
      [copy = pipe_->copy, file = std::make_shared<InputFile>(pipe_->copy->path())](
          char* buffer, std::size_t size) { return file->read(buffer, size); },
      limits_));
}

OpenedFile open_recording(ByteSource bytes) {
  constexpr std::size_t looked_at = 640;
  const std::string start(bytes.peek(looked_at));
  const std::string path = bytes.path();
  if (start.starts_with("ULog\x01\x12\x35"sv)) {
    return decoded(open_ulog(std::move(bytes)));
  }
  if (start.starts_with("\xA3\x95"sv)) {
    return decoded(open_dataflash(std::move(bytes)));
  }
  if (start.starts_with("#ROSBAG V2.0"sv)) {
    return decoded(open_rosbag1(std::move(bytes)));
  }
  if (start.starts_with("\x89MCAP0\r\n"sv)) {
    return decoded(open_mcap(std::move(bytes)));
  }
  if (start.starts_with("SQLite format 3\0"sv)) {
    return with_file(
        std::move(bytes), UnlinkTime::after,
        [](const std::string& file, const std::string& name, const ReadBudget& budget) {
          return decoded(open_rosbag2(file, name, budget));
        });
  }
  if (start.starts_with("PK\x03\x04"sv)) {
    return with_file(std::move(bytes), UnlinkTime::before, &open_zip);
  }
  if (start.starts_with("\x93NUMPY")) {
    return table("npy", open_npy_log(std::move(bytes), {}), path);
  }
  if (start.starts_with("MATLAB 7.3 ")) {
    return with_file(
        std::move(bytes), UnlinkTime::before,
        [](const std::string& file, const std::string& name, const ReadBudget& budget) {
          return table("mat", open_mat73_log(file, name, budget), name);
        });
  }
  if (start.starts_with("\x89HDF\r\n\x1a\n"sv)) {
    return with_file(
        std::move(bytes), UnlinkTime::before,
        [](const std::string& file, const std::string& name, const ReadBudget& budget) {
          return table("hdf5", open_hdf5_log(file, name, budget), name);
        });
  }
  if (start.starts_with("MATLAB ")) {
    return table("mat", open_mat_log(std::move(bytes)), path);
  }
  for (const std::string_view other : {"%PDF"sv, "<!DOCTYPE"sv, "<html"sv, "<?xml"sv, "{\\rtf"sv}) {
    if (start.starts_with(other)) {
      throw DataError(path, "is a document, not a recording or a table");
    }
  }
  if (is_blackbox(start)) {
    return decoded(open_blackbox(std::move(bytes)));
  }
  if (is_tlog(start)) {
    return decoded(open_tlog(std::move(bytes)));
  }
  return open_text(std::move(bytes));
}

void read_table(OpenedFile& opened, const std::vector<std::string>& names) {
  if (!opened.text) {
    if (opened.table && !names.empty()) {
      opened.table->columns = column_names(opened.table_name, names, opened.table->columns.size());
    }
    return;
  }
  const std::string compression = opened.text->compression();
  opened.table = open_text_log(*std::move(opened.text), names);
  opened.text.reset();
  if (!compression.empty()) {
    opened.table->notes.push_back(formatted("unpacked ({})", compression));
  }
  if (opened.format.empty()) {
    opened.format = format_of_table(opened.table->columns);
  }
}

OpenedFile open_recording(const std::string& path, const ReadLimits& limits) {
  std::error_code none;
  if (path == "-" || !std::filesystem::is_directory(path, none)) {
    return open_recording(ByteSource(path, limits));
  }
  std::vector<OpenedFile> opened;
  for (const std::string& file : files_in_folder(path)) {
    try {
      opened.push_back(open_recording(ByteSource(file, limits)));
      read_table(opened.back(), {});
    } catch (const LimitError&) {
      throw;
    } catch (const DataError&) {
      if (!opened.empty() && opened.back().text) {
        opened.pop_back();  // a table without numbers, such as Metadata.csv
      }
    }
  }
  if (opened.empty()) {
    throw DataError(path, "is a directory whose files contain no numbers");
  }
  return opened.size() == 1 ? std::move(opened.front()) : joined_recordings(std::move(opened));
}

DecoderPointer series_of(OpenedFile opened) {
  read_table(opened, {});
  return opened.is_table() ? decoder_of_table(std::move(opened)) : std::move(opened.decoder);
}

RecordingFile::RecordingFile(const std::string& path, const ReadLimits& limits)
    : path_(path), decoder_(series_of(open_recording(path, limits))) {}

RecordingFile::~RecordingFile() = default;
RecordingFile::RecordingFile(RecordingFile&&) noexcept = default;
RecordingFile& RecordingFile::operator=(RecordingFile&&) noexcept = default;

const std::string& RecordingFile::format() const {
  return decoder_->format;
}
bool RecordingFile::read(SeriesSink& sink) {
  return decoder_->read(sink);
}
std::vector<std::string> RecordingFile::notes() const {
  return decoder_->notes();
}
const std::map<std::string, std::string>& RecordingFile::facts() const {
  return decoder_->facts;
}

}  // namespace axiscal
