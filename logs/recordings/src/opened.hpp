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
  std::string format;                      ///< empty for a table of text until read_table()
  std::string table_name;                  ///< name of the table, usually stem_of() its file
  std::optional<ByteSource> text;          ///< a table of text, UTF-8 or Latin-1
  std::unique_ptr<LogFile::Source> table;  ///< a table of numbers
  DecoderPointer decoder;                  ///< decoder of a file that is not a table

  [[nodiscard]] bool is_table() const { return decoder == nullptr; }
};

/// Reads the start of a table of text, to find its columns and its format.
/// @param names  names of columns without a header; may be empty.
/// @throws DataError  if the text does not contain a row of numbers.
void read_table(OpenedFile& opened, const std::vector<std::string>& names);

/// Recognises a file by its content, and opens it.
/// @throws DataError  for the reasons of RecordingFile's constructor.
[[nodiscard]] OpenedFile open_recording(const std::string& path, const ReadLimits& limits = {});

/// Recognises the format of bytes from an open file or a part of an archive, and opens them.
/// @throws DataError  for the reasons of RecordingFile's constructor.
[[nodiscard]] OpenedFile open_recording(ByteSource bytes);

/// Converts a table to series: columns of one kind and unit form one series.
/// @param opened  a table for which read_table() was called.
[[nodiscard]] DecoderPointer decoder_of_table(OpenedFile opened);

/// @return the series of an open file; a table is converted to series.
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

/// @return several recordings as one that contains the series of all of them.
[[nodiscard]] OpenedFile joined_recordings(std::vector<OpenedFile> parts);

/// @return the bytes of a text in memory.
[[nodiscard]] ByteSource bytes_of_text(const std::string& path,
                                       std::string text,
                                       const ReadBudget& budget);

/// Opens JSON as a table of text: a list of records, one record per line, or an object of columns.
[[nodiscard]] OpenedFile open_json(ByteSource bytes);

/// Converts the output of Arduino sketches, `X: 1.5 Y: -2 Z: 3`, and lines with the prefix of a
/// serial monitor, `14:08:06.818 -> 1.5,-2,3`, to a table with commas. Other text stays unchanged.
[[nodiscard]] ByteSource printed_lines_as_table(ByteSource bytes);

/// @return the first sheet of a workbook that contains numbers, as text with commas.
/// @param part  returns the content of a part of the archive; empty if there is no such part.
[[nodiscard]] std::string csv_of_workbook(
    const std::string& name,
    const std::function<std::string(const std::string& part)>& part,
    const ReadBudget& budget);

/// A temporary copy of a source that can be read only once.
class SpooledFile {
 public:
  /// @param name  name of the source, for messages.
  /// @throws OutputError  if TMPDIR is not a writable folder.
  SpooledFile(std::string name, ReadBudget budget);
  /// @throws OutputError  if the disk is full.
  void write(const char* buffer, std::size_t size);

  /// Removes the name of the copy from its folder. A file that is already open can still be read.
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
  /// @throws DataError  for the reasons of open_recording().
  [[nodiscard]] OpenedFile open();

  /// Declares that the file will not be opened again, so that the bytes of a pipe are no longer
  /// copied.
  void disable_reopening();

 private:
  struct Pipe;
  std::string path_;
  ReadLimits limits_;
  std::shared_ptr<Pipe> pipe_;  // the pipe and its copy, after the first open(); null for a file
};

/// @return the name of the file without its folder and its ending.
[[nodiscard]] std::string stem_of(const std::string& path);

}  // namespace axiscal
