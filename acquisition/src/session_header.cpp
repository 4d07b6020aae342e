// SPDX-License-Identifier: Apache-2.0
#include "axiscal/acquisition/session_header.hpp"

#include <utility>

#include "acquisition/src/journal_point.hpp"
#include "axiscal/acquisition/journal.hpp"
#include "axiscal/core/timestamp.hpp"
#include "axiscal/core/version.hpp"
#include "core/json_document.hpp"
#include "field/field_json.hpp"

namespace axiscal {
namespace {

Json sheet_json(const std::vector<RunSheetRow>& sheet) {
  Json rows = Json::array();
  for (const RunSheetRow& row : sheet) {
    Json one = {{"run", row.run}, {"block", row.block}};
    put_point(one, row.entry.point);
    one["level"] = level_json(row.entry.level);
    if (row.temperature) {
      one["temperature"] = *row.temperature;
    }
    rows.push_back(std::move(one));
  }
  return rows;
}

std::vector<RunSheetRow> sheet_of(const JsonValue& header) {
  std::vector<RunSheetRow> sheet;
  for (const JsonValue& one : header.at("sheet").elements()) {
    RunSheetRow row{.run = one.at("run").integer(),
                    .block = one.at("block").integer(),
                    .entry = {.point = point_of(one), .level = level_of(one.at("level"))},
                    .temperature = {}};
    if (const std::optional<JsonValue> temperature = one.find("temperature")) {
      row.temperature = temperature->number();
    }
    sheet.push_back(row);
  }
  return sheet;
}

}  // namespace

std::string session_header_line(const SessionHeader& header) {
  Json json = {{"entry", "session"},
               {"format", journal_format},
               {"version", 1},
               {"created", timestamp_now()},
               {"software", software_name()},
               {"directory", header.directory},
               {"arguments", header.arguments},
               {"sheet", sheet_json(header.sheet)}};
  if (header.free) {
    json["free"] = true;
  }
  if (!header.experiment.empty()) {
    json["experiment"] = Json::parse(header.experiment);
  }
  return json.dump();
}

SessionHeader parse_session_header(const std::string& line, const std::string& path) {
  const JsonValue json = parse_json(line, path);
  const std::optional<JsonValue> experiment = json.find("experiment");
  const bool free = json.find("free").has_value();
  std::vector<RunSheetRow> sheet = sheet_of(json);
  if (sheet.empty() && !free) {
    json.at("sheet").fail("must contain at least one point");
  }
  return {.directory = json.at("directory").text(),
          .arguments = json.at("arguments").texts(),
          .sheet = std::move(sheet),
          .free = free,
          .experiment = experiment ? experiment->dump() : ""};
}

}  // namespace axiscal
