// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <Eigen/Core>

#include "axiscal/core/json_document.hpp"
#include "axiscal/core/not_a_number.hpp"

namespace axiscal {

/// The members of an object by one table for both directions: the same calls put a struct's members
/// into JSON, or take them from a file, so that what is written is what is read.
///
/// A number that does not exist is NaN in the struct and null in the file. What is absent in a file
/// stays as it is, a number or an array of them becomes NaN; `need_` is for what must be there,
/// `_if_any` for what is not written where it is empty or zero. Calls throw as JsonValue does.
class JsonMembers {
 public:
  explicit JsonMembers(Json& to) : to_(&to) {}
  explicit JsonMembers(const JsonValue& from) : from_(&from) {}

  [[nodiscard]] bool reads() const { return from_ != nullptr; }

  /// For what is more than a member: the object itself.
  [[nodiscard]] Json& to() { return *to_; }
  [[nodiscard]] const JsonValue& from() const { return *from_; }

  void need(const char* key, std::string& text);
  void need(const char* key, double& number);
  void need(const char* key, int& number);
  void need(const char* key, bool& flag);
  void need(const char* key, std::vector<std::string>& texts);
  void need(const char* key, std::vector<int>& numbers);

  void text(const char* key, std::string& text);
  void text_if_any(const char* key, std::string& text);
  void number(const char* key, double& number);
  void number_if_any(const char* key, double& number);
  void number_if_any(const char* key, std::optional<double>& number);
  void integer(const char* key, int& number);
  void integer_if_any(const char* key, std::optional<int>& number);
  void flag(const char* key, bool& flag);

  /// Written only where it is not what it usually is.
  void flag_unless(const char* key, bool& flag, bool usual);

  void texts(const char* key, std::vector<std::string>& texts);
  void integers(const char* key, std::vector<int>& numbers);
  void integers_if_any(const char* key, std::vector<int>& numbers);

  /// {"x": .., "y": ..}
  void xy(const char* key, double& x, double& y);

  /// [low, high], both finite.
  void need_pair(const char* key, double& low, double& high);

  template <typename Vector>
  void vector(const char* key, Vector& vector, Eigen::Index size) {
    if (!reads()) {
      (*to_)[key] = json_from(vector);
      return;
    }
    const std::optional<JsonValue> value = from_->find(key);
    vector = value ? value->vector_or_nan(size) : Eigen::VectorXd::Constant(size, not_a_number);
  }

  template <typename Vector>
  void need_vector(const char* key, Vector& vector, Eigen::Index size) {
    if (!reads()) {
      (*to_)[key] = json_from(vector);
      return;
    }
    vector = from_->at(key).vector(size);
  }

  template <typename Matrix>
  void matrix(const char* key, Matrix& matrix, Eigen::Index rows, Eigen::Index columns) {
    if (!reads()) {
      (*to_)[key] = json_from_matrix(matrix);
      return;
    }
    const std::optional<JsonValue> value = from_->find(key);
    matrix = value ? value->matrix_or_nan(rows, columns)
                   : Eigen::MatrixXd::Constant(rows, columns, not_a_number);
  }

  template <typename Matrix>
  void need_matrix(const char* key, Matrix& matrix, Eigen::Index rows, Eigen::Index columns) {
    if (!reads()) {
      (*to_)[key] = json_from_matrix(matrix);
      return;
    }
    matrix = from_->at(key).matrix(rows, columns);
  }

  /// An object of its own, which must be there.
  /// @param members  called with its JsonMembers.
  template <typename Members>
  void need_object(const char* key, const Members& members) {
    if (reads()) {
      read_object(from_->at(key), members);
    } else {
      write_object((*to_)[key], members);
    }
  }

  /// An object of its own; written only `where` there is something in it.
  template <typename Members>
  void object(const char* key, bool where, const Members& members) {
    if (!reads()) {
      if (where) {
        write_object((*to_)[key], members);
      }
    } else if (const std::optional<JsonValue> value = from_->find(key)) {
      read_object(*value, members);
    }
  }

  /// @param members  called with its JsonMembers and the struct.
  template <typename Struct, typename Members>
  void object_if_any(const char* key,
                     std::optional<Struct>& value,
                     const Members& members,
                     const Struct& blank = Struct()) {
    if (reads() && from_->find(key)) {
      value = blank;
    }
    object(key, value.has_value(), [&](JsonMembers& io) { members(io, *value); });
  }

  /// An array of objects.
  /// @param members  called with each one's JsonMembers and struct.
  /// @param blank    what a struct is before it is read.
  template <typename Struct, typename Members>
  void list(const char* key,
            std::vector<Struct>& all,
            const Members& members,
            const Struct& blank = Struct()) {
    if (!reads()) {
      Json& array = (*to_)[key] = Json::array();
      for (Struct& one : all) {
        write_object(array.emplace_back(), [&](JsonMembers& io) { members(io, one); });
      }
    } else if (const std::optional<JsonValue> values = from_->find(key)) {
      for (const JsonValue& value : values->elements()) {
        Struct& one = all.emplace_back(blank);
        read_object(value, [&](JsonMembers& io) { members(io, one); });
      }
    }
  }

  template <typename Struct, typename Members>
  void list_if_any(const char* key, std::vector<Struct>& all, const Members& members) {
    if (reads() || !all.empty()) {
      list(key, all, members);
    }
  }

  /// Checks a member that was read; a DomainError becomes that member's complaint.
  void check(const char* key, const std::function<void()>& check_value) const {
    if (reads()) {
      from_->at(key).check(check_value);
    }
  }

  /// Complains of a member that was read.
  void check(const char* key, bool good, std::string_view what) const {
    if (reads() && !good) {
      from_->at(key).fail(what);
    }
  }

 private:
  template <typename Members>
  static void write_object(Json& to, const Members& members) {
    to = Json::object();
    JsonMembers io(to);
    members(io);
  }

  template <typename Members>
  static void read_object(const JsonValue& from, const Members& members) {
    JsonMembers io(from);
    members(io);
  }

  Json* to_ = nullptr;
  const JsonValue* from_ = nullptr;
};

}  // namespace axiscal
