// SPDX-License-Identifier: Apache-2.0
#include "store_client.hpp"

#include <filesystem>

#include <nlohmann/json.hpp>

#include "axiscal/core/error.hpp"
#include "input.hpp"
#include "stream_files.hpp"

namespace axiscal::cli {

bool is_store(const std::string& text) {
  return text.starts_with("postgresql://") || text.starts_with("postgres://") ||
         text.ends_with(".db");
}

bool is_store_there(const std::string& store) {
  return !store.ends_with(".db") || std::filesystem::exists(store);
}

StoreWriter::StoreWriter(const std::string& store)
    : store_(store),
      program_(store_program,
               {"store", "add", "-", "--store", store, "--quiet"},
               {.pipe = ChildProgram::Pipe::standard_input, .input_file = {}}) {}

void StoreWriter::write(std::string_view lines) {
  if (!program_.write(lines)) {
    finish();
    throw OutputError("the store ended before all records were written");
  }
}

void StoreWriter::finish() {
  if (program_.wait() != 0) {
    throw OutputError(
        "not all records are in the store; run the command again to store the "
        "others");
  }
}

std::string ask_store(const std::string& store, const std::vector<std::string>& arguments) {
  std::vector<std::string> words = {"store"};
  words.insert(words.end(), arguments.begin(), arguments.end());
  words.insert(words.end(), {"--store", store});
  ChildProgram program(store_program, words, {.input_file = {}});
  std::string text = program.read_all();
  if (program.wait() != 0) {
    throw DataError(store_program.name, "this program failed; see its message above");
  }
  return text;
}

RecordTexts named_records(const std::string& text) {
  if (is_store(text)) {
    return records_in_lines(ask_store(text, {"export"}), text);
  }
  if (text.ends_with(".jsonl") || text.ends_with(".jsonl.zst")) {
    std::string lines;
    read_complete_lines(text, [&](std::string_view line) {
      lines.append(line) += '\n';
      return true;
    });
    return records_in_lines(lines, text);
  }
  return records_in_folder(text);
}

std::string digests_of(const std::vector<InputFileDigest>& files) {
  std::string digests;
  for (const InputFileDigest& file : files) {
    digests += (digests.empty() ? "" : " ") + file.sha256;
  }
  return digests;
}

std::string stored_line(const std::string& record,
                        const std::string& station,
                        const std::string& batch) {
  std::string line = record;
  if (!station.empty() || !batch.empty()) {
    const nlohmann::json names = {{"station", station}, {"batch", batch}};
    std::string text = names.dump();
    text.back() = ',';
    line = text + "\"record\":" + line + "}";
  }
  return line + "\n";
}

std::string record_digest(const std::string& record) {
  std::string line = record;
  constexpr std::string_view key = "\"created\":\"";
  if (const std::size_t start = line.find(key); start != std::string::npos) {
    line.erase(start, line.find('"', start + key.size()) + 1 - start);
  }
  return sha256_of_text(line);
}

std::string in_one_line(const std::string& json) {
  std::string line;
  line.reserve(json.size());
  bool quoted = false;
  for (std::size_t i = 0; i < json.size(); ++i) {
    const char c = json[i];
    if (quoted && c == '\\') {
      line += c;
      line += json[++i];
      continue;
    }
    quoted = c == '"' ? !quoted : quoted;
    if (quoted || (c != ' ' && c != '\n')) {
      line += c;
    }
  }
  return line;
}

}  // namespace axiscal::cli
