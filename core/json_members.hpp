// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <vector>

#include <Eigen/Core>

#include "axiscal/core/not_a_number.hpp"
#include "core/json_document.hpp"

namespace axiscal {

/// Reads or writes the members of a struct. The same list of calls either writes the members to
/// JSON or reads them from a file, so both directions have the same format.
///
/// An unknown number is NaN in the struct and null in the file. Calls throw as JsonValue does.
class JsonMembers {
 public:
  /// Writes into the object that `to` has begun. Reasons why the result could not be read again are
  /// added to `to` (JsonWriter::problem()).
  explicit JsonMembers(JsonWriter& to) : to_(&to) {}
  explicit JsonMembers(const JsonValue& from) : from_(&from) {}

  [[nodiscard]] bool reads() const { return from_ != nullptr; }

  /// @return the writer, for types of values that JsonMembers cannot write. It must not be used
  ///         while a row of a table is written.
  [[nodiscard]] JsonWriter& to() { return *to_; }
  [[nodiscard]] const JsonValue& from() const { return *from_; }

  /// Writes a member. It must not be called while reading.
  template <typename Value>
  void put(const char* key, const Value& value) {
    if (columns_ != nullptr) {
      put_in_row(key, value);
      return;
    }
    to_->key(key);
    if constexpr (std::is_base_of_v<Eigen::EigenBase<Value>, Value>) {
      to_->numbers(value);
    } else if constexpr (std::is_same_v<Value, bool>) {
      to_->flag(value);
    } else if constexpr (std::is_integral_v<Value>) {
      to_->integer(static_cast<std::int64_t>(value));
    } else if constexpr (std::is_same_v<Value, double>) {
      to_->number(value);
    } else if constexpr (std::is_convertible_v<const Value&, std::string_view>) {
      to_->text(value);
    } else if constexpr (std::is_same_v<Value, std::vector<std::string>>) {
      to_->texts(value);
    } else if constexpr (std::is_same_v<Value, std::vector<double>>) {
      to_->numbers(Eigen::Map<const Eigen::VectorXd>(value.data(), std::ssize(value)));
    } else if constexpr (std::is_same_v<Value, std::vector<int>>) {
      to_->integers(value);
    } else {
      to_->value(value);
    }
  }

  /// Sets `value` to `read` while reading. Does nothing while writing.
  template <typename Value, typename Read>
  void keep(Value& value, Read&& read) const {
    if (reads()) {
      value = std::forward<Read>(read);
    }
  }

  /// @return while reading, true if the file has the member; while writing, `there`.
  [[nodiscard]] bool has(const char* key, bool there) const {
    return reads() ? from_->find(key).has_value() : there;
  }

  /// Reads or writes a required member: a text, number, flag, or a list of texts or integers.
  template <typename Value>
  void need(const char* key, Value& value) {
    if (reads()) {
      take(from_->at(key), value);
      return;
    }
    if constexpr (std::is_same_v<Value, double>) {
      require(std::isfinite(value), key, "must be a finite number");
    }
    put(key, value);
  }

  /// Reads or writes a member. If a file lacks it, `value` does not change.
  template <typename Value>
  void value(const char* key, Value& value) {
    if (!reads()) {
      put(key, value);
    } else if (const std::optional<JsonValue> found = from_->find(key)) {
      take(*found, value);
    }
  }

  /// Reads or writes a member like value(), but does not write a value that is empty, 0 or nullopt.
  void value_if_any(const char* key, std::string& text) { value_if(!text.empty(), key, text); }
  void value_if_any(const char* key, std::vector<int>& all) { value_if(!all.empty(), key, all); }
  void value_if_any(const char* key, std::vector<std::string>& all) {
    value_if(!all.empty(), key, all);
  }
  void value_if_any(const char* key, int& number) { value_if(number != 0, key, number); }
  void value_if_any(const char* key, double& number) {
    value_if(number > 0.0 || number < 0.0, key, number);
  }
  template <typename Value>
  void value_if_any(const char* key, std::optional<Value>& value) {
    Value present = value.value_or(Value());
    value_if(value.has_value(), key, present);
    if (reads() && from_->find(key)) {
      value = present;
    }
  }

  /// While reading, throws if the name of a member is not in `keys`.
  void allow_keys(std::span<const std::string_view> keys) const {
    if (reads()) {
      from_->allow_keys(keys);
    }
  }

  /// Reads or writes a flag like value(), but does not write a flag that equals `usual`.
  void flag_unless(const char* key, bool& flag, bool usual) { value_if(flag != usual, key, flag); }

  /// Reads or writes a member whose value is one of several names. An empty name in a file does not
  /// change `value`.
  /// @param name_of  returns the name of a value.
  /// @param parse    returns the value of a name, or nullopt.
  /// @param known    the list of names for the error message; may be empty.
  template <typename Value, typename NameOf, typename Parse>
  void choice(
      const char* key, Value& value, NameOf name_of, Parse parse, std::string_view known = {}) {
    std::string name(name_of(value));
    this->value(key, name);
    choose(key, name, value, parse, known);
  }

  /// Reads or writes a member like choice(), but does not write a value with an empty name.
  template <typename Value, typename NameOf, typename Parse>
  void choice_if_any(
      const char* key, Value& value, NameOf name_of, Parse parse, std::string_view known = {}) {
    std::string name(name_of(value));
    value_if_any(key, name);
    choose(key, name, value, parse, known);
  }

  /// Reads or writes a member like choice(), but does not write a value that equals `usual`.
  template <typename Value, typename NameOf, typename Parse>
  void choice_unless(const char* key,
                     Value& value,
                     Value usual,
                     NameOf name_of,
                     Parse parse,
                     std::string_view known = {}) {
    if (reads() ? from_->find(key).has_value() : value != usual) {
      choice(key, value, name_of, parse, known);
    }
  }

  /// Reads or writes a number. If a file lacks it, `number` becomes NaN.
  void number(const char* key, double& number) {
    if (reads()) {
      number = not_a_number;
    }
    value(key, number);
  }

  /// Reads or writes an object {"x": .., "y": ..}. A number that is absent or null becomes NaN.
  void xy(const char* key, double& x, double& y);

  /// Reads or writes a required array [low, high] of two finite numbers.
  void need_pair(const char* key, double& low, double& high);

  template <typename Vector>
  void vector(const char* key, Vector& vector, Eigen::Index size) {
    if (!reads()) {
      require(vector.size() == size, key, "has the wrong length");
      put(key, vector);
      return;
    }
    const std::optional<JsonValue> value = from_->find(key);
    vector = value ? value->vector_or_nan(size) : Eigen::VectorXd::Constant(size, not_a_number);
  }

  template <typename Vector>
  void need_vector(const char* key, Vector& vector, Eigen::Index size) {
    if (!reads()) {
      require(vector.size() == size && vector.allFinite(), key, "must be finite numbers");
      put(key, vector);
      return;
    }
    vector = from_->at(key).vector(size);
  }

  template <typename Matrix>
  void matrix(const char* key, Matrix& matrix, Eigen::Index rows, Eigen::Index columns) {
    if (!reads()) {
      put_matrix(key, matrix, matrix.rows() == rows && matrix.cols() == columns);
      return;
    }
    const std::optional<JsonValue> value = from_->find(key);
    matrix = value ? value->matrix_or_nan(rows, columns)
                   : Eigen::MatrixXd::Constant(rows, columns, not_a_number);
  }

  template <typename Matrix>
  void need_matrix(const char* key, Matrix& matrix, Eigen::Index rows, Eigen::Index columns) {
    if (!reads()) {
      put_matrix(key, matrix,
                 matrix.rows() == rows && matrix.cols() == columns && matrix.allFinite());
      return;
    }
    matrix = from_->at(key).matrix(rows, columns);
  }

  /// Reads or writes a required member that is an object.
  /// @param members  called with the JsonMembers of that object.
  template <typename Members>
  void need_object(const char* key, const Members& members) {
    if (reads()) {
      read_object(from_->at(key), members);
    } else {
      write_object(key, members);
    }
  }

  /// Reads or writes a member that is an object. It is written only if `where` is true.
  template <typename Members>
  void object(const char* key, bool where, const Members& members) {
    if (!reads()) {
      if (where) {
        write_object(key, members);
      }
    } else if (const std::optional<JsonValue> value = from_->find(key)) {
      read_object(*value, members);
    }
  }

  /// Reads or writes an optional struct as an object. It is written only if `value` is present.
  /// @param members  called with the object's JsonMembers and the struct.
  /// @param blank    value of the struct before its members are read.
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

  /// Reads or writes an array of objects, one for each struct.
  /// @param members  called with the JsonMembers and the struct of each object.
  /// @param blank    value of each struct before its members are read.
  template <typename Struct, typename Members>
  void list(const char* key,
            std::vector<Struct>& all,
            const Members& members,
            const Struct& blank = Struct()) {
    if (!reads()) {
      to_->key(key);
      to_->begin_list();
      for (Struct& one : all) {
        to_->begin_object();
        members(*this, one);
        to_->end_object();
      }
      to_->end_list();
    } else if (const std::optional<JsonValue> values = from_->find(key)) {
      for (const JsonValue& value : values->elements()) {
        Struct& one = all.emplace_back(blank);
        read_object(value, [&](JsonMembers& io) { members(io, one); });
      }
    }
  }

  /// Reads or writes structs like list(), but writes more than 200 structs as an object with one
  /// array for each member, so that names are not repeated. It reads both forms.
  template <typename Struct, typename Members>
  void table(const char* key, std::vector<Struct>& all, const Members& members) {
    if (!reads()) {
      constexpr std::size_t most_rows = 200;
      if (all.size() <= most_rows) {
        list(key, all, members);
        return;
      }
      JsonColumns columns(all.size(), to_->layout());
      JsonMembers io(*to_);
      io.columns_ = &columns;
      for (Struct& one : all) {
        columns.begin_row();
        members(io, one);
      }
      to_->key(key);
      columns.write_to(*to_);
    } else if (const std::optional<JsonValue> values = from_->find(key)) {
      values->for_each_row([&](const JsonValue& value) {
        Struct& one = all.emplace_back();
        read_object(value, [&](JsonMembers& io) { members(io, one); });
      });
    }
  }

  template <typename Struct, typename Members>
  void list_if_any(const char* key,
                   std::vector<Struct>& all,
                   const Members& members,
                   const Struct& blank = Struct()) {
    if (reads() || !all.empty()) {
      list(key, all, members, blank);
    }
  }

  /// While reading, calls check_value() and converts a DomainError to a DataError that states the
  /// member's place.
  void check(const char* key, const std::function<void()>& check_value) const {
    if (reads()) {
      from_->at(key).check(check_value);
    }
  }

  /// If `good` is false: while reading, throws a DataError with the member's place; while writing,
  /// adds a problem to the writer.
  void check(const char* key, bool good, std::string_view what) const {
    if (reads() && !good) {
      from_->at(key).fail(what);
    }
    require(reads() || good, key, what);
  }

 private:
  template <typename Value, typename Parse>
  void choose(
      const char* key, const std::string& name, Value& value, Parse parse, std::string_view known) {
    if (!reads() || name.empty()) {
      return;
    }
    const auto parsed = parse(name);
    if (!parsed) {
      from_->at(key).fail("'" + name + "' is not a known value" +
                          (known.empty() ? "" : "; the known values are " + std::string(known)));
    }
    value = *parsed;
  }

  static void take(const JsonValue& from, std::string& text) { text = from.text(); }
  static void take(const JsonValue& from, double& number) { number = from.number(); }
  static void take(const JsonValue& from, int& number) { number = from.integer(); }
  static void take(const JsonValue& from, bool& flag) { flag = from.boolean(); }
  static void take(const JsonValue& from, std::vector<std::string>& all) { all = from.texts(); }
  static void take(const JsonValue& from, std::vector<int>& all);

  template <typename Value>
  void value_if(bool written, const char* key, Value& value) {
    if (reads() || written) {
      this->value(key, value);
    }
  }

  // While writing, adds a problem to the writer if `good` is false.
  void require(bool good, std::string_view key, std::string_view what) const {
    if (!good) {
      to_->add_problem(key, what);
    }
  }

  template <typename Value>
  void put_in_row(const char* key, const Value& value) {
    if constexpr (std::is_base_of_v<Eigen::EigenBase<Value>, Value>) {
      columns_->put_numbers(key, value);
    } else if constexpr (std::is_same_v<Value, double>) {
      columns_->put_number(key, value);
    } else if constexpr (std::is_same_v<Value, int>) {
      columns_->put_integer(key, value);
    } else if constexpr (std::is_convertible_v<const Value&, std::string_view>) {
      columns_->put_text(key, value);
    } else {
      columns_->put_value(key, value);
    }
  }

  void put_matrix(const char* key, const Eigen::Ref<const Eigen::MatrixXd>& matrix, bool good) {
    require(good, key, "must be a matrix of numbers of the right size");
    to_->key(key);
    to_->matrix(matrix);
  }

  template <typename Members>
  void write_object(const char* key, const Members& members) {
    to_->key(key);
    to_->begin_object();
    members(*this);
    to_->end_object();
  }

  template <typename Members>
  static void read_object(const JsonValue& from, const Members& members) {
    JsonMembers io(from);
    members(io);
  }

  JsonWriter* to_ = nullptr;
  JsonColumns* columns_ = nullptr;  // receives the members while a row of a table is written
  const JsonValue* from_ = nullptr;
};

}  // namespace axiscal
