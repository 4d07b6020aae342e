// SPDX-License-Identifier: Apache-2.0
// ROS 2 bags in SQLite (github.com/ros2/rosbag2, rosbag2_storage_sqlite3). The database has the
// tables `topics` and `messages`, and since ROS 2 Iron also `message_definitions`.
#include "axiscal/core/error.hpp"
#include "core/formatted.hpp"
#include "logs/recordings/src/series_decoder.hpp"

#ifdef AXISCAL_SQLITE
#include <algorithm>
#include <cctype>
#include <filesystem>
#include <map>
#include <memory>
#include <sqlite3.h>
#include <string>

#include "logs/recordings/src/ros_message.hpp"
#include "logs/recordings/src/unpacker.hpp"
#endif

namespace axiscal {

#ifdef AXISCAL_SQLITE
namespace {

struct CloseDatabase {
  void operator()(sqlite3* database) const { sqlite3_close_v2(database); }
};
struct FinishStatement {
  void operator()(sqlite3_stmt* statement) const { sqlite3_finalize(statement); }
};
using Statement = std::unique_ptr<sqlite3_stmt, FinishStatement>;

// @return a URI with which SQLite opens the bag without creating any file next to it, not even the
//         index of a write-ahead log.
std::string immutable_uri(const std::string& path) {
  std::string uri = "file:";
  for (const char c : path) {
    const bool is_plain = std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '/' ||
                          c == '.' || c == '-' || c == '_';
    uri += is_plain ? std::string(1, c)
                    : formatted("%{:02X}", static_cast<unsigned>(static_cast<unsigned char>(c)));
  }
  return uri + "?immutable=1";
}

class Rosbag2 final : public RecordingFile::Decoder {
 public:
  Rosbag2(const std::string& path, std::string name, ReadBudget budget)
      : name_(std::move(name)), budget_(std::move(budget)) {
    format = "rosbag2";
    sqlite3* database = nullptr;
    const int status = sqlite3_open_v2(immutable_uri(path).c_str(), &database,
                                       SQLITE_OPEN_READONLY | SQLITE_OPEN_URI, nullptr);
    database_.reset(database);
    if (status != SQLITE_OK) {
      fail("cannot be opened as a database");
    }
    // The file is not trusted: functions in its schema are disabled, and its pages are checked.
    sqlite3_db_config(database, SQLITE_DBCONFIG_DEFENSIVE, 1, nullptr);
    sqlite3_db_config(database, SQLITE_DBCONFIG_TRUSTED_SCHEMA, 0, nullptr);
    sqlite3_exec(database, "PRAGMA cell_size_check=ON", nullptr, nullptr, nullptr);
    // No value in the file is longer than the file. The limit stops SQL expressions that would
    // create longer ones.
    constexpr double shortest = 1U << 20U, longest = 1U << 30U;
    sqlite3_limit(database, SQLITE_LIMIT_LENGTH,
                  static_cast<int>(std::clamp(budget_.file_bytes(), shortest, longest)));
    sqlite3_progress_handler(database, steps_at_once, &spend_steps, this);
    require_table("topics");
    require_table("messages");
    note_unread_log(path);
    const Statement topics = prepare("SELECT id, name, type FROM topics");
    if (topics == nullptr) {
      fail("is a database without the tables 'topics' and 'messages' of a ROS 2 bag");
    }
    const std::map<std::string, std::string> definitions = read_definitions();
    constexpr std::size_t most_topics = 4096;
    while (step(topics) == SQLITE_ROW && topics_.size() < most_topics) {
      const std::string type = text(topics, 2);
      const auto definition = definitions.find(type);
      topics_.emplace(sqlite3_column_int64(topics.get(), 0),
                      RosTopic(text(topics, 1), type,
                               definition == definitions.end() ? "" : definition->second, budget_));
    }
    messages_ = prepare("SELECT topic_id, timestamp, data FROM messages ORDER BY timestamp");
    if (messages_ == nullptr) {
      fail("is a database without the table 'messages' of a ROS 2 bag");
    }
  }

  bool read(SeriesSink& sink) override {
    const int status = step(messages_);
    if (status != SQLITE_ROW) {
      if (status != SQLITE_DONE) {
        damage_ = sqlite3_errmsg(database_.get());
      }
      return false;
    }
    const auto topic = topics_.find(sqlite3_column_int64(messages_.get(), 0));
    const auto* const data = static_cast<const char*>(sqlite3_column_blob(messages_.get(), 2));
    const int size = sqlite3_column_bytes(messages_.get(), 2);
    if (topic == topics_.end() || data == nullptr || size <= 0) {
      return true;
    }
    using namespace std::string_view_literals;
    std::string_view message(data, static_cast<std::size_t>(size));
    std::optional<std::string> unpacked;
    if (message.starts_with("\x28\xb5\x2f\xfd"sv)) {  // single messages are compressed
      unpacked = unpack_zstd(message, budget_);
      message = unpacked ? std::string_view(*unpacked) : ""sv;
    }
    topic->second.put(sink, message, RosWire::cdr,
                      static_cast<double>(sqlite3_column_int64(messages_.get(), 1)) * 1e-9, count_);
    return true;
  }

  std::vector<std::string> notes() const override {
    std::vector<const RosTopic*> topics;
    for (const auto& [id, topic] : topics_) {
      topics.push_back(&topic);
    }
    std::vector<std::string> all = notes_of(topics);
    all.insert(all.end(), notes_.begin(), notes_.end());
    if (!damage_.empty()) {
      all.push_back(formatted(
          "the database is damaged; only the part before the damage was read: {}", damage_));
    }
    return all;
  }

 private:
  static constexpr int steps_at_once = 10000;

  // Counts steps of SQLite's virtual machine. A damaged index or a view can cause an endless loop.
  static int spend_steps(void* self) {
    return static_cast<Rosbag2*>(self)->budget_.may_spend(ReadCost::steps, steps_at_once) ? 0 : 1;
  }

  int step(const Statement& statement) {
    const int status = sqlite3_step(statement.get());
    if (status == SQLITE_INTERRUPT) {
      budget_.fail(ReadCost::steps);
    }
    return status;
  }

  [[noreturn]] void fail(const std::string& why) const { throw DataError(name_, why); }

  // Refuses a file in which `table` is missing or is a view, whose query may never end.
  void require_table(const char* table) {
    const Statement found = prepare(
        formatted("SELECT 1 FROM sqlite_master WHERE name = '{}' AND type = 'table' AND sql LIKE "
                  "'CREATE TABLE%'",
                  table)
            .c_str());
    if (found == nullptr || step(found) != SQLITE_ROW) {
      fail(formatted("is a database without the table '{}' of a ROS 2 bag", table));
    }
  }

  void note_unread_log(const std::string& path) {
    std::error_code none;
    const std::uintmax_t size = std::filesystem::file_size(path + "-wal", none);
    if (!none && size > 0) {
      notes_.push_back(
          formatted("the file {}-wal contains messages that are not read; run `sqlite3 {} 'PRAGMA "
                    "wal_checkpoint'` to move these messages into the bag",
                    path, path));
    }
  }

  Statement prepare(const char* sql) {
    sqlite3_stmt* statement = nullptr;
    sqlite3_prepare_v2(database_.get(), sql, -1, &statement, nullptr);
    return Statement(statement);
  }

  static std::string text(const Statement& statement, int column) {
    const auto* const bytes =
        reinterpret_cast<const char*>(sqlite3_column_text(statement.get(), column));
    return bytes == nullptr ? "" : bytes;
  }

  std::map<std::string, std::string> read_definitions() {
    std::map<std::string, std::string> definitions;
    const Statement rows = prepare(
        "SELECT topic_type, encoded_message_definition FROM message_definitions WHERE encoding = "
        "'ros2msg'");
    while (rows != nullptr && step(rows) == SQLITE_ROW) {
      definitions[text(rows, 0)] = text(rows, 1);
    }
    return definitions;
  }

  std::string name_;
  ReadBudget budget_;
  std::vector<std::string> notes_;
  std::unique_ptr<sqlite3, CloseDatabase> database_;
  std::map<std::int64_t, RosTopic> topics_;
  Statement messages_;
  std::string damage_;
  std::size_t count_ = 0;
};

}  // namespace

DecoderPointer open_rosbag2(const std::string& path,
                            const std::string& name,
                            const ReadBudget& budget) {
  return std::make_unique<Rosbag2>(path, name, budget);
}
#else
DecoderPointer open_rosbag2(const std::string&, const std::string& name, const ReadBudget&) {
  throw DataError(name, "is a ROS 2 bag (SQLite), but this axiscal was built without libsqlite3");
}
#endif

}  // namespace axiscal
