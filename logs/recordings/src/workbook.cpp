// SPDX-License-Identifier: Apache-2.0
// Spreadsheets of Office Open XML (ECMA-376, SpreadsheetML). The first sheet that contains numbers
// is converted to CSV.
#include <algorithm>
#include <functional>

#include "axiscal/core/csv_reader.hpp"
#include "axiscal/core/error.hpp"
#include "axiscal/core/number_text.hpp"
#include "core/formatted.hpp"
#include "logs/recordings/src/opened.hpp"

#ifdef AXISCAL_PUGIXML
#include <pugixml.hpp>
#endif

namespace axiscal {

#ifdef AXISCAL_PUGIXML
namespace {

constexpr std::size_t most_sheets = 256;
constexpr std::size_t most_columns = 16384;  // limit of the file format

// @return the zero-based column of a cell from its reference: 54 for "BC12".
std::size_t column_of(std::string_view reference) {
  std::size_t column = 0;
  for (const char c : reference) {
    if (c < 'A' || c > 'Z' || column > most_columns) {
      break;
    }
    column = 26 * column + static_cast<std::size_t>(c - 'A') + 1;
  }
  return column == 0 ? 0 : column - 1;
}

// @return the text of a string element, which may consist of several differently formatted parts.
std::string text_of(const pugi::xml_node& node) {
  std::string text = node.child("t").text().as_string();
  for (const pugi::xml_node run : node.children("r")) {
    text += run.child("t").text().as_string();
  }
  return text;
}

// Spends an estimate of the memory that pugixml needs for a document: a copy of its text, 96 bytes
// for each '<', and 40 bytes for each '='. In pugixml a node has 64 bytes, and an attribute 40
// bytes.
void spend_memory(const std::string& xml, const ReadBudget& budget) {
  const auto count = [&](char c) {
    return static_cast<double>(std::count(xml.begin(), xml.end(), c));
  };
  budget.spend(ReadCost::memory,
               static_cast<double>(xml.size()) + 96.0 * count('<') + 40.0 * count('='));
}

std::vector<std::string> shared_strings(const std::string& xml, const ReadBudget& budget) {
  spend_memory(xml, budget);
  std::vector<std::string> strings;
  pugi::xml_document document;
  if (document.load_buffer(xml.data(), xml.size())) {
    for (const pugi::xml_node node : document.child("sst").children("si")) {
      strings.push_back(text_of(node));
      budget.spend(ReadCost::memory, sizeof(std::string) + strings.back().size());
    }
  }
  return strings;
}

struct Sheet {
  std::string csv;
  std::size_t numbers = 0;
};

Sheet read_sheet(const std::string& xml,
                 const std::vector<std::string>& strings,
                 const ReadBudget& budget) {
  spend_memory(xml, budget);
  Sheet sheet;
  pugi::xml_document document;
  if (!document.load_buffer(xml.data(), xml.size())) {
    return sheet;
  }
  std::size_t line = 1;
  for (const pugi::xml_node row : document.child("worksheet").child("sheetData").children("row")) {
    // Omitted rows become empty lines, so that line numbers agree with the sheet.
    constexpr unsigned most_rows = 1U << 20U;
    const unsigned number = row.attribute("r").as_uint(static_cast<unsigned>(line));
    while (line < number && line < most_rows) {
      budget.spend(ReadCost::cells, 1.0);
      sheet.csv += '\n';
      ++line;
    }
    std::size_t column = 0;
    std::size_t next = 0;  // column of the next cell, unless the cell states one
    std::string text;
    for (const pugi::xml_node cell : row.children("c")) {
      const std::string_view reference = cell.attribute("r").as_string();
      const std::size_t place = reference.empty() ? next : column_of(reference);
      next = place + 1;
      if (place > most_columns) {
        break;
      }
      for (; column < place; ++column) {
        budget.spend(ReadCost::cells, 1.0);
        text += ',';
      }
      budget.spend(ReadCost::cells, 1.0);
      const std::string_view type = cell.attribute("t").as_string();
      const std::string value = cell.child("v").text().as_string();
      if (type == "s") {
        const auto index =
            static_cast<std::size_t>(std::max(parse_integer(trimmed(value)).value_or(-1), -1));
        const std::string words = index < strings.size() ? strings[index] : "";
        sheet.numbers += parse_number(trimmed(words)).has_value() ? 1U : 0U;
        text += csv_cell(words);
      } else if (type == "inlineStr") {
        const std::string words = text_of(cell.child("is"));
        sheet.numbers += parse_number(trimmed(words)).has_value() ? 1U : 0U;
        text += csv_cell(words);
      } else {
        sheet.numbers += parse_number(value).has_value() ? 1U : 0U;
        text += csv_cell(value);
      }
    }
    budget.spend(ReadCost::memory, 2 * text.size());  // a growing string may need twice its size
    sheet.csv += text + '\n';
    ++line;
  }
  return sheet;
}

}  // namespace

std::string csv_of_workbook(const std::string& name,
                            const std::function<std::string(const std::string& part)>& part,
                            const ReadBudget& budget) {
  const std::vector<std::string> strings = shared_strings(part("xl/sharedStrings.xml"), budget);
  for (std::size_t number = 1; number <= most_sheets; ++number) {
    const std::string xml = part(formatted("xl/worksheets/sheet{}.xml", number));
    if (xml.empty()) {
      break;
    }
    Sheet sheet = read_sheet(xml, strings, budget);
    if (sheet.numbers > 0) {
      return std::move(sheet.csv);
    }
  }
  throw DataError(name, "no sheet of the workbook contains numbers");
}
#else
std::string csv_of_workbook(const std::string& name,
                            const std::function<std::string(const std::string& part)>&,
                            const ReadBudget&) {
  throw DataError(
      name,
      "is a spreadsheet, but this axiscal was built without libpugixml; save the spreadsheet "
      "as CSV");
}
#endif

}  // namespace axiscal
