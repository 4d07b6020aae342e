// SPDX-License-Identifier: Apache-2.0
// The commands check, budget and study; limits, batches and suggestions.
#include <algorithm>
#include <cmath>
#include <filesystem>

#include <gmock/gmock.h>
#include <nlohmann/json.hpp>

#include "axiscal/core/units.hpp"
#include "program.hpp"
#include "scenario.hpp"

namespace axiscal::test {
namespace {

using nlohmann::json;
using testing::HasSubstr;

constexpr const char* truth_text = R"({"format":"axiscal-calibration","version":1,
"instrument":{"kind":"accelerometer","serial":"s1","axes":["x","y","z"],"unit":"V"},
"field":{"kind":"gravity","unit":"g","magnitude":1.0,"in_table":[0,0,1]},
"coefficients":{"bias":[0.01,-0.02,0.03],
"sensitivity":[[1.0,0.02,-0.01],[0.015,0.98,0.02],[-0.02,0.01,1.03]]}})";

class TrustCommands : public testing::Test {
 protected:
  std::string observed(const std::string& name,
                       const std::string& seed,
                       std::vector<std::string> more = {}) {
    const std::string path = folder_.path(name);
    std::vector<std::string> arguments = {"simulate", "--truth", truth_, "--noise", "1e-4",
                                          "--seed",   seed,      "-o",   path};
    arguments.insert(arguments.end(), more.begin(), more.end());
    EXPECT_EQ(run_axiscal(arguments).status, 0);
    return path;
  }

  ProgramResult calibrate(const std::string& run, std::vector<std::string> more) {
    std::vector<std::string> arguments = {"calibrate", run,       "--instrument", "accelerometer",
                                          "--field",   "gravity", "--unit",       "V"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    return run_axiscal(arguments);
  }

  std::string record(const std::string& name,
                     const std::string& seed,
                     const std::string& blocks = "4") {
    const std::string path = folder_.path(name);
    EXPECT_EQ(
        calibrate(observed(name + ".csv", seed, {"--replicates", blocks}), {"-o", path}).status, 0);
    return path;
  }

  ScratchFolder folder_;
  std::string truth_ = folder_.write("truth.json", truth_text);
};

TEST_F(TrustCommands, CheckSaysWhetherARecordStillHolds) {
  const std::string old = record("old.json", "1");
  const ProgramResult good = run_axiscal({"check", old, observed("good.csv", "2"), "--json"});
  EXPECT_EQ(good.status, 0);
  const json checked = json::parse(good.out);
  EXPECT_FALSE(checked["drifted"]);
  EXPECT_EQ(checked["changes"].size(), 12U);
  EXPECT_EQ(checked["changes"][0]["parameter"], "x.bias");
  std::string moved = truth_text;
  moved.replace(moved.find("0.98,0.02"), 9, "0.985,0.02");
  truth_ = folder_.write("moved.json", moved);
  const std::string fresh = observed("bad.csv", "3");
  const ProgramResult bad = run_axiscal({"check", old, fresh});
  EXPECT_EQ(bad.status, 1);
  EXPECT_THAT(bad.out, HasSubstr("drifted"));
  EXPECT_EQ(run_axiscal({"check", old, record("new.json", "4")}).status, 1);
  const std::string at_rest = folder_.write("rest.csv", "x,y,z\n0.01,-0.02,1.061\n0.0,0.0,1.07\n");
  const ProgramResult in_situ = run_axiscal({"check", old, at_rest, "--json"});
  EXPECT_EQ(in_situ.status, 1);
  EXPECT_FALSE(json::parse(in_situ.out)["readings"][1]["within"]);
  EXPECT_EQ(run_axiscal({"check", old}).status, 2);
  EXPECT_EQ(run_axiscal({"check", old, folder_.path("none.csv")}).status, 3);
}

TEST_F(TrustCommands, HistorySaysWhenALimitWillBeMet) {
  // A bias of 10 mV grows by 1 mV each year and is 15 mV after five years.
  const std::string folder = folder_.path("records");
  std::filesystem::create_directory(folder);
  for (int year = 0; year < 4; ++year) {
    json one = json::parse(truth_text);
    one["created"] = std::to_string(2020 + year) + "-07-01T00:00:00Z";
    one["coefficients"]["bias"][0] = 0.010 + 0.001 * year;
    folder_.write("records/" + std::to_string(year) + ".json", one.dump());
  }
  folder_.write("records/other.json", "{}");
  const auto limits = [&](const char* text) {
    return folder_.write(
        "limits.json",
        std::string(R"({"format":"axiscal-limits","version":1,"limits":[)") + text + "]}");
  };
  const ProgramResult result =
      run_axiscal({"check", "--history", folder, "--limits",
                   limits(R"({"parameter":"x.bias","high":0.015})"), "--json"});
  EXPECT_EQ(result.status, 0);
  EXPECT_THAT(result.err, HasSubstr("skipped"));
  const json trend = json::parse(result.out)[0]["trends"][0];
  EXPECT_NEAR(trend["slope_per_year"].get<double>(), 0.001, 1e-6);
  EXPECT_THAT(trend["meets_limit_on"].get<std::string>(), HasSubstr("2025-0"));
  EXPECT_EQ(run_axiscal({"check", "--history", folder, "--limits",
                         limits(R"({"parameter":"x.bias","high":0.012})")})
                .status,
            1);
  EXPECT_EQ(run_axiscal({"check", "--history", folder, "--limits",
                         limits(R"({"parameter":"x.bios","high":0.012})")})
                .status,
            3);
  EXPECT_EQ(run_axiscal({"check", "--history", folder_.path("none")}).status, 3);
}

TEST_F(TrustCommands, HistoryPassesOverWhatIsStrange) {
  const std::string folder = folder_.path("records");
  std::filesystem::create_directory(folder);
  json one = json::parse(truth_text);
  one["created"] = "2020-07-01T00:00:00Z";
  folder_.write("records/good.json", one.dump());
  const std::string deep(200000, '[');
  folder_.write("records/deep.json",
                R"({"a": )" + deep + std::string(200000, ']') + R"(, "b": 1})");
  json wide = one;
  wide["statistics"]["parameter_names"] = std::vector<std::string>(60000, "p");
  wide["statistics"]["covariance"] = {{1.0}};
  folder_.write("records/wide.json", wide.dump());
  json other = one;  // one axis with the name "x, y, z"
  other["instrument"]["axes"] = {"x, y, z"};
  other["coefficients"] = {{"bias", {0.1}}, {"sensitivity", {{1.0, 0.0, 0.0}}}};
  folder_.write("records/other.json", other.dump());
  const ProgramResult result = run_axiscal({"check", "--history", folder, "--json"});
  EXPECT_EQ(result.status, 0) << result.err;
  EXPECT_THAT(result.err, HasSubstr("deep.json: is nested more than 1000 levels deep"));
  EXPECT_THAT(result.err, HasSubstr("wide.json: /statistics/covariance: must have 60000 rows"));
  const json units = json::parse(result.out);
  ASSERT_EQ(units.size(), 2U);
  EXPECT_EQ(units[0]["trends"].size() + units[1]["trends"].size(), 16U);
}

// The values scatter, so the date has an interval. If the slope may be 0, the interval has no end.
TEST_F(TrustCommands, TheDateOfALimitHasAnInterval) {
  const std::string folder = folder_.path("records");
  std::filesystem::create_directory(folder);
  const auto dates = [&](double scatter) {
    const std::vector<double> off = {0.3, -0.5, 0.4, -0.6, 0.5, -0.1};
    for (int year = 0; year < 6; ++year) {
      json one = json::parse(truth_text);
      one["created"] = std::to_string(2015 + year) + "-07-01T00:00:00Z";
      one["coefficients"]["bias"][0] =
          0.010 + 0.001 * year + scatter * off[static_cast<std::size_t>(year)];
      folder_.write("records/" + std::to_string(year) + ".json", one.dump());
    }
    const std::string limits = folder_.write(
        "limits.json",
        R"({"format":"axiscal-limits","version":1,"limits":[{"parameter":"x.bias","high":0.02}]})");
    const ProgramResult result =
        run_axiscal({"check", "--history", folder, "--limits", limits, "--json"});
    EXPECT_EQ(result.status, 0) << result.err;
    return json::parse(result.out)[0]["trends"][0];
  };
  const json sure = dates(1e-4);
  EXPECT_THAT(sure["meets_limit_on"].get<std::string>(), HasSubstr("2025-"));
  EXPECT_LT(sure["meets_limit_from"].get<std::string>(), sure["meets_limit_on"].get<std::string>());
  EXPECT_GT(sure["meets_limit_until"].get<std::string>(),
            sure["meets_limit_on"].get<std::string>());
  const json unsure = dates(6e-3);
  EXPECT_TRUE(unsure["meets_limit_until"].is_null());
}

// --history: earlier records give the scatter of biases between blocks, as a prior.
TEST_F(TrustCommands, EarlierRecordsSayHowBiasesChangeBetweenBlocks) {
  const std::string folder = folder_.path("earlier");
  std::filesystem::create_directory(folder);
  const std::string truth = folder_.write("truth.json", truth_text);
  const auto run = [&](int seed, const char* replicates) {
    const std::string path = folder_.path("run" + std::to_string(seed) + ".csv");
    const ProgramResult made =
        run_axiscal({"simulate", "--truth", truth, "--replicates", replicates, "--noise", "1e-4",
                     "--world", "block_sd=1e-3", "--seed", std::to_string(seed), "-o", path});
    EXPECT_EQ(made.status, 0) << made.err;
    return path;
  };
  const std::vector<std::string> unit = {
      "--instrument", "accelerometer", "--field", "gravity", "--unit", "V", "--serial", "A7"};
  const auto calibrate = [&](std::vector<std::string> arguments) {
    arguments.insert(arguments.begin(), "calibrate");
    arguments.insert(arguments.end(), unit.begin(), unit.end());
    return run_axiscal(arguments);
  };
  for (int i = 1; i <= 3; ++i) {
    EXPECT_EQ(calibrate({run(i, "3"), "-o", folder + "/" + std::to_string(i) + ".json"}).status, 0);
  }
  const std::string today = run(9, "1");
  const ProgramResult with = calibrate({today, "--history", folder, "--json"});
  ASSERT_EQ(with.status, 0) << with.err;
  const json record = json::parse(with.out);
  EXPECT_EQ(record["conditions"]["kind"], "intermediate");
  EXPECT_EQ(record["conditions"]["earlier"], 3);
  const json alone = json::parse(calibrate({today, "--json"}).out);
  EXPECT_EQ(alone["conditions"]["kind"], "repeatability");
  EXPECT_GT(record["statistics"]["interval_95"]["bias"][0].get<double>(),
            5.0 * alone["statistics"]["interval_95"]["bias"][0].get<double>());
  const ProgramResult nobody =
      run_axiscal({"calibrate", today, "--instrument", "accelerometer", "--field", "gravity",
                   "--unit", "V", "--history", folder, "--json"});
  EXPECT_EQ(nobody.status, 2);
  EXPECT_THAT(nobody.err, HasSubstr("--serial, --model"));
  EXPECT_EQ(calibrate({today, "--history", folder_.path("none")}).status, 3);
}

TEST_F(TrustCommands, LimitsGiveAVerdictForEachUnitAndABatch) {
  const std::string limits = folder_.write(
      "limits.json",
      R"({"format":"axiscal-limits","version":1,"rule":"guarded","limits":[{"parameter":"x.bias","low":-0.02,"high":0.02}]})");
  const std::string run = observed("run.csv", "1");
  const std::string stored = folder_.path("cal.json");
  const ProgramResult passed = calibrate(run, {"--limits", limits, "-o", stored, "--serial", "A1"});
  EXPECT_EQ(passed.status, 0);
  EXPECT_THAT(passed.err, HasSubstr("A1: pass"));
  EXPECT_TRUE(json::parse(read_file(stored))["verdict"]["passed"]);
  std::string other = truth_text;
  other.replace(other.find("0.01,-0.02"), 10, "0.05,-0.02");
  truth_ = folder_.write("other.json", other);
  const std::string second = observed("second.csv", "2");
  std::string batch = "serial,run,block,rest,fence,x,y,z\n";
  for (const auto& [serial, path] : {std::pair("A1", run), std::pair("A2", second)}) {
    const std::string text = read_file(path);
    for (std::size_t at = text.find('\n') + 1; at < text.size();) {
      const std::size_t end = text.find('\n', at);
      batch += std::string(serial) + "," + text.substr(at, end + 1 - at);
      at = end + 1;
    }
  }
  const std::string table = folder_.path("table.csv");
  const ProgramResult units =
      calibrate(folder_.write("batch.csv", batch),
                {"--limits", limits, "--table", table, "-o", folder_.path("unit-{serial}.json")});
  EXPECT_EQ(units.status, 1);
  EXPECT_THAT(units.out, HasSubstr("A1: pass"));
  EXPECT_THAT(units.out, HasSubstr("A2: fail: x.bias"));
  EXPECT_THAT(units.out, HasSubstr("yield: 1 of 2 (50.0 %)"));
  EXPECT_THAT(read_file(table), HasSubstr("A2,fail,"));
  EXPECT_FALSE(json::parse(read_file(folder_.path("unit-A2.json")))["verdict"]["passed"]);
  EXPECT_EQ(calibrate(run, {"--limits", folder_.path("none.json")}).status, 3);
  const std::string experiment = folder_.write(
      "experiment.json",
      R"({"format":"axiscal-experiment","version":1,"observations":"second.csv","limits":"limits.json",
          "instrument":{"kind":"accelerometer"},"field":{"kind":"gravity"}})");
  EXPECT_THAT(run_axiscal({"calibrate", experiment}).err, HasSubstr("unit: fail: x.bias"));
}

// A batch without a column of serials is one unit. The verdict of check is that of the record.
TEST_F(TrustCommands, ATableOfOneUnitAndOneVerdict) {
  const std::string run =
      folder_.write("one.csv", observations_text(accelerometer_truth(), {.noise_sd = 1e-4}));
  const std::string limits =
      folder_.write("limits.json",
                    R"({"format": "axiscal-limits", "version": 1, "rule": "guarded",
          "limits": [{"parameter": "x.bias", "low": -9, "high": 9}]})");
  const std::vector<std::string> as = {"--instrument", "accelerometer", "--field",
                                       "gravity",      "--limits",      limits};
  const auto calibrated = [&](std::vector<std::string> words) {
    words.insert(words.begin(), {"calibrate", run});
    words.insert(words.end(), as.begin(), as.end());
    return run_axiscal(words);
  };
  const ProgramResult table = calibrated({"--table", folder_.path("t.csv"), "--serial", "QA-1"});
  EXPECT_EQ(table.status, 0) << table.err;
  EXPECT_THAT(table.out, testing::HasSubstr("yield: 1 of 1 (100.0 %)"));
  EXPECT_EQ(csv_cells(read_file(folder_.path("t.csv")))[1][0], "QA-1");
  ASSERT_EQ(calibrated({"-o", folder_.path("one.json")}).status, 0);
  const ProgramResult check =
      run_axiscal({"check", folder_.path("one.json"), run, "--limits", limits, "--json"});
  const nlohmann::json mine = nlohmann::json::parse(check.out)["verdict"]["limits"][0];
  const nlohmann::json records = read_json(folder_.path("one.json"))["verdict"]["limits"][0];
  for (const auto& [key, value] : records.items()) {
    EXPECT_TRUE(mine.contains(key)) << key;
  }
  EXPECT_EQ(mine["high"], 9);
}

TEST_F(TrustCommands, SuggestionsAreMadeAndFollowedOnlyOnRequest) {
  std::string text = read_file(observed("run.csv", "5"));
  const std::size_t row = text.find("\n7,");
  const std::size_t rest = text.find(',', row + 3) + 1;
  text[rest] = text[rest] == '+' ? '-' : '+';  // upside down
  const std::string run = folder_.write("bad.csv", text);
  const std::string stored = folder_.path("cal.json");
  const ProgramResult refused = calibrate(run, {"-o", stored});
  EXPECT_EQ(refused.status, 1);
  EXPECT_THAT(refused.err, HasSubstr("warning: run 7 fits"));
  EXPECT_THAT(refused.err, HasSubstr("upside down"));
  EXPECT_EQ(folder_.file_count(), 3U);
  const ProgramResult accepted = calibrate(run, {"-o", stored, "--accept-suggestion"});
  EXPECT_EQ(accepted.status, 0);
  const json kept = json::parse(read_file(stored));
  EXPECT_EQ(kept["status"], "ok");
  EXPECT_EQ(kept["corrections"][0]["runs"], json({7}));
}

TEST_F(TrustCommands, BudgetAndApplyStateUncertainties) {
  // A record of one block has no scatter between blocks, which would give the Monte Carlo long
  // tails.
  const std::string stored = record("cal.json", "1", "1");
  const ProgramResult budget = run_axiscal(
      {"budget", stored, "--pitch", "30", "--roll", "45", "--monte-carlo", "2000", "--json"});
  EXPECT_EQ(budget.status, 0);
  const json shown = json::parse(budget.out);
  EXPECT_EQ(shown["parameters"].size(), 12U);
  EXPECT_EQ(shown["attitude"][4]["name"], "pitch_deg");
  EXPECT_NEAR(shown["attitude"][4]["value"].get<double>(), 30.0, 1e-9);
  EXPECT_TRUE(shown["monte_carlo"][4]["agrees"]);
  EXPECT_THAT(run_axiscal({"budget", stored, "--map", "45"}).out, HasSubstr("U (95 %) of pitch"));
  const ProgramResult applied = run_axiscal({"apply", stored, stored + ".csv", "--uncertainty"});
  EXPECT_EQ(applied.status, 0);
  EXPECT_THAT(applied.out, HasSubstr(",u_field_x,u_field_y,u_field_z,u_residual,u_pitch_deg"));
  EXPECT_EQ(run_axiscal({"budget", truth_}).status, 3);
  EXPECT_EQ(run_axiscal({"apply", truth_, stored + ".csv", "--uncertainty"}).status, 3);
}

// U = k u. U of a component is large if its scatter has two degrees of freedom.
TEST_F(TrustCommands, ApplyStatesExpandedUncertainties) {
  const std::string stored = record("cal.json", "1");
  const auto cells = [&](std::vector<std::string> more) {
    more.insert(more.begin(), {"apply", stored, stored + ".csv"});
    const ProgramResult result = run_axiscal(more);
    EXPECT_EQ(result.status, 0) << result.err;
    return csv_cells(result.out);
  };
  const auto rows = cells({"--expanded"});
  const auto column = [&](const std::string& name) {
    const auto at = std::find(rows[0].begin(), rows[0].end(), name);
    EXPECT_NE(at, rows[0].end()) << name;
    return static_cast<std::size_t>(at - rows[0].begin());
  };
  for (const char* const name : {"field_x", "residual", "pitch_deg"}) {
    const double u = std::stod(rows[1][column(std::string("u_") + name)]);
    const double U = std::stod(rows[1][column(std::string("U_") + name)]);
    const double k = std::stod(rows[1][column(std::string("k_") + name)]);
    EXPECT_NEAR(U, k * u, 1e-9 * U) << name;
    EXPECT_GT(k, 1.96) << name;
    EXPECT_LT(k, 13.0) << name;
  }
  EXPECT_EQ(rows[0].back(), "flag");
  const auto wider = cells({"--expanded", "--level", "0.99"});
  EXPECT_GT(std::stod(wider[1][column("U_field_x")]), std::stod(rows[1][column("U_field_x")]));
  EXPECT_EQ(wider[1][column("u_field_x")], rows[1][column("u_field_x")]);
  for (const std::vector<std::string>& wrong : std::vector<std::vector<std::string>>{
           {"--expanded", "--level", "1"}, {"--level", "0.9"}, {"--field-magnitude-u", "1"}}) {
    std::vector<std::string> words = {"apply", stored, stored + ".csv"};
    words.insert(words.end(), wrong.begin(), wrong.end());
    EXPECT_EQ(run_axiscal(words).status, 2) << wrong.front();
  }
}

// pitch = asin(f / F), so an error of 0.1 % of F changes the angle by 0.001 tan(pitch).
TEST_F(TrustCommands, AnglesElsewhereCountTheFieldsUncertainty) {
  const std::string stored = record("cal.json", "1");
  const std::string log = folder_.write("log.csv", "x,y,z\n0.5,0.0,0.87\n");
  const auto pitch = [&](std::vector<std::string> more) {
    more.insert(more.begin(), {"apply", stored, log, "--uncertainty", "--noise", "0"});
    const auto rows = csv_cells(run_axiscal(more).out);
    const auto cell = [&](const std::string& name) {
      const auto at = std::find(rows[0].begin(), rows[0].end(), name);
      return std::stod(rows[1].at(static_cast<std::size_t>(at - rows[0].begin())));
    };
    return std::pair(cell("pitch_deg"), cell("u_pitch_deg"));
  };
  const auto [angle, here] = pitch({"--field-magnitude", "1"});
  const double there = pitch({"--field-magnitude", "1", "--field-magnitude-u", "0.001"}).second;
  const double expected = 0.001 * std::tan(angle * rad_per_deg) * deg_per_rad;
  EXPECT_NEAR(std::sqrt(there * there - here * here), expected, 0.01 * expected);
}

TEST_F(TrustCommands, StudyShardsMergeToTheSameBytes) {
  const auto study = [&](std::vector<std::string> more) {
    std::vector<std::string> arguments = {"study",    "--truth", truth_,   "--noise", "1e-4",
                                          "--trials", "700",     "--seed", "3"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    return run_axiscal(arguments);
  };
  const ProgramResult whole = study({"--json"});
  EXPECT_EQ(whole.status, 0);
  EXPECT_NEAR(json::parse(whole.out)["parameters"][0]["coverage_95"].get<double>(), 0.95, 0.04);
  std::vector<std::string> merge = {"study", "--json", "--merge"};
  for (const char* shard : {"2/2", "1/2"}) {
    merge.push_back(folder_.path(std::string("part") + shard[0]));
    EXPECT_EQ(study({"--shard", shard, "-o", merge.back()}).status, 0);
  }
  EXPECT_EQ(run_axiscal(merge).out, whole.out);
  merge.pop_back();
  EXPECT_EQ(run_axiscal(merge).status, 1);  // a shard is missing
  EXPECT_EQ(study({"--shard", "3/2"}).status, 2);
}

TEST_F(TrustCommands, TemperaturePlansSoaksAndFlags) {
  const std::string plan = folder_.path("plan.csv");
  EXPECT_EQ(run_axiscal({"plan", "--temperatures", "0,40", "-o", plan}).status, 0);
  EXPECT_THAT(read_file(plan), HasSubstr("run,block,rest,fence,x,y,z,temperature\n"));
  const std::string run = observed("run.csv", "1", {"--temperatures", "0,20,40"});
  const std::string stored = folder_.path("cal.json");
  EXPECT_EQ(calibrate(run, {"--temperature-order", "1", "-o", stored}).status, 0);
  const std::string hot = folder_.write("hot.csv", "temperature,x,y,z\n60,0,0,1\n20,0,0,1\n");
  const ProgramResult applied = run_axiscal({"apply", stored, hot});
  EXPECT_THAT(applied.out, HasSubstr(",extrapolated\n"));
  EXPECT_THAT(applied.err, HasSubstr("1 of 2 rows are at temperatures outside"));
  EXPECT_EQ(run_axiscal({"apply", stored, folder_.write("no.csv", "x,y,z\n0,0,1\n")}).status, 3);
  EXPECT_EQ(calibrate(run, {"--temperature-order", "x"}).status, 2);
  std::string log = "time,temperature\n";
  for (int t = 0; t <= 600; t += 10) {
    log += std::to_string(t) + "," + std::to_string(20.0 + 0.01 * t) + "\n";
  }
  const ProgramResult rising = run_axiscal({"plan", "--soak", folder_.write("log.csv", log)});
  EXPECT_EQ(rising.status, 1);
  EXPECT_THAT(rising.out, HasSubstr("not steady"));
}

}  // namespace
}  // namespace axiscal::test
