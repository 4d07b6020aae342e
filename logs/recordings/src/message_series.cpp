// SPDX-License-Identifier: Apache-2.0
#include <utility>

#include "axiscal/core/printable_text.hpp"
#include "logs/recordings/src/series_decoder.hpp"

namespace axiscal {
namespace {

std::vector<Series> by_rule(const std::vector<std::string>& columns,
                            const MessageSeries::Rule& rule) {
  std::vector<Series> all;
  for (const std::string& column : columns) {
    all.push_back(rule(column));
  }
  return all;
}

}  // namespace

MessageSeries::MessageSeries(const std::string& name,
                             int instance,
                             const std::vector<std::string>& columns,
                             const Rule& rule)
    : MessageSeries(name, instance, columns, by_rule(columns, rule)) {}

MessageSeries::MessageSeries(const std::string& name,
                             int instance,
                             const std::vector<std::string>& columns,
                             const std::vector<Series>& of_columns) {
  for (std::size_t c = 0; c < columns.size(); ++c) {
    Series of_column = of_columns[c];
    // Fields of the same kind and unit form one series, even if they are not adjacent.
    Part* part = nullptr;
    for (Part& other : parts_) {
      const bool full = other.series.kind != SeriesKind::other && other.series.columns.size() == 3;
      if (other.series.kind == of_column.kind && other.series.unit == of_column.unit && !full) {
        part = &other;
      }
    }
    if (part == nullptr) {
      of_column.name = printable_name(name);
      of_column.instance = instance;
      of_column.columns.clear();
      part = &parts_.emplace_back(Part{.series = std::move(of_column)});
    }
    part->series.columns.push_back(printable_name(columns[c]));
    part->places.push_back(c);
  }
}

void MessageSeries::announce(SeriesSink& sink, std::size_t& count) {
  for (Part& part : parts_) {
    part.number = count++;
    sink.add(part.series);
  }
  announced_ = true;
}

void MessageSeries::put(SeriesSink& sink, double time_s, std::span<const double> message) {
  for (const Part& part : parts_) {
    values_.clear();
    for (const std::size_t place : part.places) {
      values_.push_back(message[place]);
    }
    sink.sample(part.number, time_s, values_);
  }
}

}  // namespace axiscal
