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

/// A file that was recognised: a table of text, one of numbers, or a decoder of its series.
struct OpenedFile {
  std::string format;                      ///< of a table of text: empty until read_table()
  std::string table_name;                  ///< of a table: its subject, from the file's name
  std::optional<ByteSource> text;          ///< a table of text, UTF-8 or Latin-1
  std::unique_ptr<LogFile::Source> table;  ///< a table of numbers
  DecoderPointer decoder;                  ///< of a file that is not a table

  [[nodiscard]] bool is_table() const { return decoder == nullptr; }
};

/// Reads the start of a table of text, to find its columns and its format.
/// @param names  for columns without a header; may be empty.
/// @throws DataError  if the text does not contain a row of numbers.
void read_table(OpenedFile& opened, const std::vector<std::string>& names);

/// Recognises a file by its content, and opens it.
/// @throws DataError  as RecordingFile.
[[nodiscard]] OpenedFile open_recording(const std::string& path, const ReadLimits& limits = {});

/// As above, for a part of an archive or an open file.
[[nodiscard]] OpenedFile open_recording(ByteSource bytes);

/// A table as series: its columns by kind and unit. Read by read_table() already.
[[nodiscard]] DecoderPointer decoder_of_table(OpenedFile opened);

/// @return an open file as series; a table is converted.
[[nodiscard]] DecoderPointer series_of(OpenedFile opened);

/// As summarise() of a path, for an open file.
[[nodiscard]] RecordingSummary summarise(RecordingFile::Decoder& decoder,
                                         std::optional<std::size_t> most_samples = {});

/// A zip archive: NumPy's .npz, a spreadsheet, or tables of a phone.
/// @param path  of a file that libarchive can open.
/// @param name  for messages.
[[nodiscard]] OpenedFile open_zip(const std::string& path,
                                  const std::string& name,
                                  const ReadBudget& budget);

/// Several recordings as one, each with its series.
[[nodiscard]] OpenedFile joined_recordings(std::vector<OpenedFile> parts);

/// A text that is in memory.
[[nodiscard]] ByteSource bytes_of_text(const std::string& path,
                                       std::string text,
                                       const ReadBudget& budget);

/// JSON as a table of text: records, one record a line, or columns.
[[nodiscard]] OpenedFile open_json(ByteSource bytes);

/// Converts the output of sketches, `X: 1.5 Y: -2 Z: 3`, and the prefix of a serial monitor,
/// `14:08:06.818 -> 1.5,-2,3`, into a table with commas. Another text stays unchanged.
[[nodiscard]] ByteSource printed_lines_as_table(ByteSource bytes);

/// @return the first sheet of a workbook that holds numbers, as text with commas.
/// @param part  gives the content of a part of the archive; empty where it is not there.
[[nodiscard]] std::string csv_of_workbook(
    const std::string& name,
    const std::function<std::string(const std::string& part)>& part,
    const ReadBudget& budget);

/// A temporary copy of a source that can be read only once.
class SpooledFile {
 public:
  /// @param name  of the source, for messages.
  /// @throws OutputError  if TMPDIR is not a writable folder.
  SpooledFile(std::string name, ReadBudget budget);
  /// @throws OutputError  if the disk is full.
  void write(const char* buffer, std::size_t size);

  /// Removes the name now, as TemporaryFile does. A file that is already open can still be read.
  void remove_name() { file_.remove_name(); }

  [[nodiscard]] const std::string& path() const { return file_.path(); }

 private:
  std::string name_;
  ReadBudget budget_;
  TemporaryFile file_;
};

/// A file that can be opened more than once, even a pipe. The bytes read from a pipe are copied
/// until it is clear that one pass is enough.
class ReopenableFile {
 public:
  explicit ReopenableFile(std::string path, const ReadLimits& limits = {})
      : path_(std::move(path)), limits_(limits) {}

  /// @throws DataError  as open_recording().
  [[nodiscard]] OpenedFile open();

  /// Declares that the file will not be opened again: copying stops.
  void disable_reopening();

 private:
  struct Pipe;
  std::string path_;
  ReadLimits limits_;
  std::shared_ptr<Pipe> pipe_;  // the pipe and its copy, after the first open(); null for a file
};

/// @return the file's name without folder and ending.
[[nodiscard]] std::string stem_of(const std::string& path);

}  // namespace axiscal
