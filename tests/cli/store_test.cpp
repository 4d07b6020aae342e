// SPDX-License-Identifier: Apache-2.0
// Stores of calibrations in an SQLite file: add, find, verify and migrate records.
#ifdef AXISCAL_SQLITE
#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <sqlite3.h>
#include <sstream>
#include <thread>

#include <nlohmann/json.hpp>

#include "matchers.hpp"
#include "program.hpp"
#include "scenario.hpp"

namespace axiscal::test {
namespace {

using testing::HasSubstr;
using testing::Not;

void change(const std::string& database, const std::string& sql) {
  sqlite3* opened = nullptr;
  ASSERT_EQ(sqlite3_open(database.c_str(), &opened), SQLITE_OK);
  char* message = nullptr;
  EXPECT_EQ(sqlite3_exec(opened, sql.c_str(), nullptr, nullptr, &message), SQLITE_OK) << message;
  sqlite3_close(opened);
}

class StoreTest : public testing::Test {
 protected:
  static ProgramResult axiscal(const std::vector<std::string>& arguments) {
    return run_axiscal(arguments);
  }

  ProgramResult store(std::vector<std::string> arguments) const {
    arguments.insert(arguments.begin(), "store");
    arguments.insert(arguments.end(), {"--store", store_});
    return run_axiscal(arguments);
  }

  // Calibrates the run as one unit measured on `day`, and stores the record.
  ProgramResult calibrate(const std::string& serial,
                          const std::string& day,
                          std::vector<std::string> more = {}) const {
    std::vector<std::string> arguments = {"calibrate",    run_, "--instrument", "accelerometer",
                                          "--unit",       "V",  "--serial",     serial,
                                          "--calibrated", day,  "--store",      store_};
    arguments.insert(arguments.end(), more.begin(), more.end());
    return run_axiscal(arguments);
  }

  // CSV text with the same readings for each unit, and the columns serial and batch.
  static std::string units(int count) {
    std::istringstream run(observations_text(accelerometer_truth(), {.noise_sd = 1e-4}));
    std::string header;
    std::getline(run, header);
    std::string rows;
    std::string text = "serial,batch," + header + "\n";
    std::vector<std::string> all;
    for (std::string row; std::getline(run, row);) {
      all.push_back(row);
    }
    for (int unit = 0; unit < count; ++unit) {
      for (const std::string& row : all) {
        text += "u" + std::to_string(unit) + ",b" + std::to_string(unit / 10) + "," + row + "\n";
      }
    }
    return text;
  }

  ProgramResult stream(const std::string& units_path, std::vector<std::string> more) const {
    std::vector<std::string> arguments = {"calibrate",     units_path, "--stream", "--instrument",
                                          "accelerometer", "--unit",   "V",        "--store",
                                          store_};
    arguments.insert(arguments.end(), more.begin(), more.end());
    return run_axiscal(arguments);
  }

  std::size_t count() const {
    const auto yield = nlohmann::json::parse(store({"list", "--yield", "--json"}).out);
    return yield["calibrations"];
  }

  ScratchFolder folder_;
  std::string store_ = folder_.path("lab.db");
  std::string run_ = folder_.write(
      "run.csv", observations_text(accelerometer_truth(), {.noise_sd = 1e-4, .seed = 1}));
};

TEST_F(StoreTest, TheRecordThatHeldThen) {
  ASSERT_EQ(calibrate("A", "2024-03-01", {"-o", folder_.path("2024.json")}).status, 0);
  ASSERT_EQ(calibrate("A", "2026-03-01").status, 0);
  ASSERT_EQ(calibrate("B", "2025-03-01").status, 0);
  const auto measured_at = [&](const std::string& date) {
    const ProgramResult shown = store({"show", "--serial", "A", "--at", date});
    return shown.status == 0 ? nlohmann::json::parse(shown.out)["measured"].get<std::string>()
                             : shown.err;
  };
  EXPECT_EQ(measured_at("2024-03-01"), "2024-03-01");
  EXPECT_EQ(measured_at("2026-02-28"), "2024-03-01");
  EXPECT_EQ(measured_at("2026-03-01"), "2026-03-01");
  EXPECT_EQ(measured_at("2030-01-01"), "2026-03-01");
  EXPECT_THAT(measured_at("2023-01-01"),
              HasSubstr("the date of its first calibration is 2024-03-01"));
  EXPECT_EQ(store({"show", "--serial", "A", "--at", "soon"}).status, 2);
  EXPECT_EQ(store({"show"}).status, 2);
  EXPECT_THAT(store({"show", "--serial", "C"}).err,
              HasSubstr("not contain a calibration of unit 'C'"));
  // The stored record equals the file.
  EXPECT_EQ(nlohmann::json::parse(store({"show", "--serial", "A", "--at", "2025-01-01"}).out),
            read_json(folder_.path("2024.json")));
  // `apply` gives the same result with the stored record as with the file.
  const ProgramResult by_store =
      axiscal({"apply", run_, "--store", store_, "--serial", "A", "--at", "2025-01-01"});
  EXPECT_EQ(by_store.status, 0) << by_store.err;
  EXPECT_EQ(by_store.out, axiscal({"apply", folder_.path("2024.json"), run_}).out);
  EXPECT_EQ(axiscal({"apply", run_, "--store", store_}).status, 2);
  EXPECT_EQ(axiscal({"apply", folder_.path("2024.json"), run_, "--at", "2025-01-01"}).status, 2);
}

TEST_F(StoreTest, NothingIsStoredTwice) {
  ASSERT_EQ(calibrate("A", "2024-03-01", {"-o", folder_.path("a.json")}).status, 0);
  const ProgramResult again = store({"add", folder_.path("a.json")});
  EXPECT_EQ(again.status, 0);
  EXPECT_THAT(again.err, HasSubstr("records added: 0; already stored: 1"));
  // A second calibration of the same readings with the same settings is not stored again.
  ASSERT_EQ(calibrate("A", "2024-03-01").status, 0);
  EXPECT_EQ(count(), 1U);
  ASSERT_EQ(calibrate("A", "2024-03-01", {"--method", "paired"}).status, 0);
  EXPECT_EQ(count(), 2U);
}

TEST_F(StoreTest, StreamsAndSeveralWritersAtOnce) {
  const std::string units_path = folder_.write("units.csv", units(40));
  std::vector<std::thread> writers;
  writers.reserve(4);
  for (int shard = 1; shard <= 4; ++shard) {
    writers.emplace_back([&, shard] {
      EXPECT_EQ(stream(units_path, {"--shard", std::to_string(shard) + "/4"}).status, 0);
    });
  }
  for (std::thread& writer : writers) {
    writer.join();
  }
  EXPECT_EQ(count(), 40U);
  const ProgramResult again = stream(units_path, {"--resume"});
  EXPECT_EQ(again.status, 0) << again.err;
  EXPECT_THAT(again.err, HasSubstr("40 were calibrated in an earlier call"));
  EXPECT_EQ(stream(units_path, {}).status, 0);
  EXPECT_EQ(count(), 40U);
  EXPECT_EQ(csv_cells(store({"list", "--batch", "b3"}).out).size(), 11U);
  const ProgramResult verified = store({"verify"});
  EXPECT_EQ(verified.status, 0) << verified.out;
  EXPECT_THAT(verified.out, HasSubstr("calibrations: 40; defects: 0"));
  // A store that is filled from the exported lines lists as many calibrations.
  ASSERT_EQ(store({"export", "-o", folder_.path("all.jsonl.zst")}).status, 0);
  const std::string list = store({"list"}).out;
  store_ = folder_.path("copy.db");
  ASSERT_EQ(store({"add", folder_.path("all.jsonl.zst")}).status, 0);
  EXPECT_EQ(csv_cells(store({"list"}).out).size(), csv_cells(list).size());
}

TEST_F(StoreTest, AUnitThatAppearsTwiceIsAnError) {
  const std::string text = units(3);
  const std::size_t first_row = text.find('\n') + 1;
  const std::string units_path = folder_.write("units.csv", text + text.substr(first_row));
  const ProgramResult result = stream(units_path, {});
  EXPECT_EQ(result.status, 1);
  EXPECT_THAT(result.err, HasSubstr("yield: 3 of 6"));
  const std::string list = store({"list", "--status", "error"}).out;
  EXPECT_THAT(list, HasSubstr("the serial number 'u0' occurs again"));
  EXPECT_EQ(csv_cells(store({"list", "--status", "ok"}).out).size(), 4U);
}

TEST_F(StoreTest, HistoriesComeFromAFolderAStoreOrLines) {
  const std::string records = folder_.path("records");
  for (const char* const day : {"2023-03-01", "2024-03-01", "2025-03-01"}) {
    ASSERT_EQ(calibrate("A", day).status, 0);
  }
  ASSERT_EQ(store({"export", "-o", records}).status, 0);
  ASSERT_EQ(store({"export", "-o", folder_.path("all.jsonl")}).status, 0);
  const std::string by_folder = axiscal({"check", "--history", records}).out;
  EXPECT_THAT(by_folder, HasSubstr("A: 3 records from 2023-03-01 to 2025-03-01"));
  EXPECT_EQ(axiscal({"check", "--history", store_}).out, by_folder);
  EXPECT_EQ(axiscal({"check", "--history", folder_.path("all.jsonl")}).out, by_folder);
}

TEST_F(StoreTest, BadInputIsRefusedAndWhatWasStoredStays) {
  ASSERT_EQ(calibrate("A", "2024-03-01", {"-o", folder_.path("a.json")}).status, 0);
  const std::string bad = folder_.write("bad.json", "{\"format\": \"other\"}");
  std::filesystem::remove(store_);
  const ProgramResult half = store({"add", folder_.path("a.json"), bad});
  EXPECT_EQ(half.status, 3);
  EXPECT_THAT(half.err, HasSubstr("bad.json"));
  EXPECT_EQ(count(), 1U);
  // A file that is no store is refused and does not change.
  const std::string text = folder_.write("notes.db", "these are my notes, and no database");
  EXPECT_EQ(axiscal({"store", "add", folder_.path("a.json"), "--store", text}).status, 3);
  EXPECT_EQ(read_file(text), "these are my notes, and no database");
  const std::string others = folder_.path("other.db");
  change(others, "CREATE TABLE birds (name TEXT)");
  const ProgramResult refused =
      axiscal({"store", "add", folder_.path("a.json"), "--store", others});
  EXPECT_EQ(refused.status, 3);
  EXPECT_THAT(refused.err, HasSubstr("another program's database"));
  EXPECT_EQ(axiscal({"store", "list", "--store", folder_.path("no.db")}).status, 3);
  EXPECT_FALSE(std::filesystem::exists(folder_.path("no.db")));
  EXPECT_EQ(store({"forget"}).status, 2);
}

TEST_F(StoreTest, SchemasOfOtherVersions) {
  ASSERT_EQ(calibrate("A", "2024-03-01").status, 0);
  change(store_, "DROP INDEX axiscal_by_result; UPDATE axiscal_store SET version = 1");
  const ProgramResult older = store({"list"});
  EXPECT_EQ(older.status, 1);
  EXPECT_THAT(older.err, HasSubstr("run `axiscal store migrate"));
  EXPECT_THAT(store({"migrate"}).err, HasSubstr("the schema was updated from version 1 to 2"));
  EXPECT_THAT(store({"migrate"}).err, HasSubstr("the store already has version 2 of the schema"));
  EXPECT_EQ(count(), 1U);
  change(store_, "UPDATE axiscal_store SET version = 99");
  const ProgramResult newer = store({"list"});
  EXPECT_EQ(newer.status, 3);
  EXPECT_THAT(newer.err, HasSubstr("install a newer axiscal"));
  EXPECT_EQ(store({"migrate"}).status, 3);
}

TEST_F(StoreTest, TheFleetPageHasTheLimitsOfTheNewestRecord) {
  const std::string limits = folder_.write(
      "limits.json", R"({"format": "axiscal-limits", "version": 1, "rule": "simple", "limits": [)"
                     R"({"parameter": "x.bias", "low": -0.25, "high": 0.75}]})");
  for (const char* const serial : {"A", "B", "C"}) {
    ASSERT_EQ(calibrate(serial, "2026-03-01", {"--limits", limits}).status, 0);
  }
  const std::string page = folder_.path("fleet.html");
  const ProgramResult report = axiscal({"report", "--fleet", store_, "-o", page});
  ASSERT_EQ(report.status, 0) << report.err;
  EXPECT_THAT(read_file(page), HasSubstr("-0.25 to 0.75"));
  EXPECT_THAT(read_file(page), HasSubstr("3 of 3 units"));
}

TEST_F(StoreTest, DamageIsFound) {
  ASSERT_EQ(calibrate("A", "2024-03-01").status, 0);
  ASSERT_EQ(calibrate("B", "2024-03-02").status, 0);
  change(store_, "UPDATE axiscal_coefficient SET value = 7 WHERE place = 0 AND calibration = 1");
  const ProgramResult changed = store({"verify"});
  EXPECT_EQ(changed.status, 1);
  EXPECT_THAT(changed.out,
              HasSubstr("A, calibrated 2024-03-01: the coefficients differ from the record"));
  EXPECT_THAT(changed.out, Not(HasSubstr("B, calibrated")));
  change(store_, "UPDATE axiscal_record SET json = x'00' WHERE calibration = 2");
  EXPECT_THAT(store({"verify"}).out,
              HasSubstr("B, calibrated 2024-03-02: the record is not compressed with zstd"));
}

}  // namespace
}  // namespace axiscal::test
#endif
