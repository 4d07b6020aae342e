// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "core/temporary_file.hpp"
#include "logs/recordings/src/log_source.hpp"
#include "logs/recordings/src/series_decoder.hpp"

namespace axiscal {

/// A file whose format is known: a table of text, a table of numbers, or a decoder of series.
struct OpenedFile {
  std::string format;                      ///< name of the format; if empty, read_table() sets it
  std::string table_name;                  ///< name of the table, usually stem_of() of the path
  std::optional<ByteSource> text;          ///< a table of text in UTF-8 or Latin-1
  std::unique_ptr<LogFile::Source> table;  ///< a table of numbers
  DecoderPointer decoder;                  ///< decoder of a file that is not a table

  [[nodiscard]] bool is_table() const { return decoder == nullptr; }
};

/// Reads the start of a table of text to find its columns and its format. For a table of numbers,
/// it only sets the names of the columns.
/// @param names  names of the columns if the file has no header; may be empty.
/// @throws DataError  if the text does not contain a row of numbers.
void read_table(OpenedFile& opened, const std::vector<std::string>& names);

/// Recognises the format of a file by its content, and opens the file.
/// @throws DataError  for the same reasons as RecordingFile's constructor.
[[nodiscard]] OpenedFile open_recording(const std::string& path, const ReadLimits& limits = {});

/// Recognises the format of bytes from an open file or a part of an archive, and opens them.
/// @throws DataError  for the same reasons as RecordingFile's constructor.
[[nodiscard]] OpenedFile open_recording(ByteSource bytes);

/// Converts a table to series. Columns of the same kind and unit form one series.
/// @param opened  a table for which read_table() was called.
[[nodiscard]] DecoderPointer decoder_of_table(OpenedFile opened);

/// @return a decoder of the series of an open file; a table is converted to series.
[[nodiscard]] DecoderPointer series_of(OpenedFile opened);

/// Summarises an open file; see summarise(const std::string&, ...).
[[nodiscard]] RecordingSummary summarise(RecordingFile::Decoder& decoder,
                                         std::optional<std::size_t> most_samples = {});

/// Opens a zip archive: NumPy's .npz, a spreadsheet, or tables from a phone.
/// @param path  path of a file that minizip can open.
/// @param name  name of the file, for messages.
[[nodiscard]] OpenedFile open_zip(const std::string& path,
                                  const std::string& name,
                                  const ReadBudget& budget);

/// @return one recording that contains the series of all `parts`.
[[nodiscard]] OpenedFile joined_recordings(std::vector<OpenedFile> parts);

/// @return a source that returns the bytes of `text`. The source keeps `text` in memory.
[[nodiscard]] ByteSource bytes_of_text(const std::string& path,
                                       std::string text,
                                       const ReadBudget& budget);

/// Opens JSON as a table of text. The JSON is a list of records, consists of lines with one record
/// each, or is an object with one list for each column.
[[nodiscard]] OpenedFile open_json(ByteSource bytes);

/// Converts lines that Arduino sketches print, such as `X: 1.5 Y: -2 Z: 3`, and lines with the time
/// stamp of a serial monitor, such as `14:08:06.818 -> 1.5,-2,3`, to CSV. Other text stays
/// unchanged.
[[nodiscard]] ByteSource printed_lines_as_table(ByteSource bytes);

/// @return the first sheet with numbers in a workbook, converted to CSV.
/// @param part  function that takes the name of a file in the workbook's zip archive, and returns
///              its content; empty if there is no such file.
[[nodiscard]] std::string csv_of_workbook(
    const std::string& name,
    const std::function<std::string(const std::string& part)>& part,
    const ReadBudget& budget);

/// A temporary file with a copy of the bytes of a source that can be read only once.
class SpooledFile {
 public:
  /// @param name  name of the source, for messages.
  /// @throws OutputError  if TMPDIR is not a writable folder.
  SpooledFile(std::string name, ReadBudget budget);
  /// @throws OutputError  if the disk is full.
  void write(const char* buffer, std::size_t size);

  /// Removes the copy's name from its folder. Processes that have the copy open can still read it.
  void remove_name() { file_.remove_name(); }

  [[nodiscard]] const std::string& path() const { return file_.path(); }

 private:
  std::string name_;
  ReadBudget budget_;
  TemporaryFile file_;
};

/// A file that can be opened several times, even if it is a pipe. The bytes that are read from a
/// pipe are copied to a temporary file until disable_reopening() is called.
class ReopenableFile {
 public:
  explicit ReopenableFile(std::string path, const ReadLimits& limits = {})
      : path_(std::move(path)), limits_(limits) {}

  /// Opens the file from its start.
  /// @throws DataError  for the same reasons as open_recording().
  [[nodiscard]] OpenedFile open();

  /// States that open() will not be called again. The bytes of a pipe are then no longer copied.
  void disable_reopening();

 private:
  struct Pipe;
  std::string path_;
  ReadLimits limits_;
  std::shared_ptr<Pipe> pipe_;  // null before the first open(), and if the file is not a pipe
};

/// @return the name of the file without its folder and its extension.
[[nodiscard]] std::string stem_of(const std::string& path);

}  // namespace axiscal
