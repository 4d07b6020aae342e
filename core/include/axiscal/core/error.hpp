// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <stdexcept>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "axiscal/core/export.hpp"
#include "axiscal/core/setting.hpp"
#include "axiscal/core/version.hpp"

namespace axiscal {

/// The base class of all exceptions that the library throws.
class AXISCAL_EXPORT Error : public std::runtime_error {
 public:
  /// @param what      the message.
  /// @param settings  the settings that would remedy the error.
  explicit Error(const std::string& what, std::vector<Setting> settings = {})
      : std::runtime_error(what), settings_(std::move(settings)) {}

  /// @return the settings that would remedy the error; empty if none would.
  [[nodiscard]] const std::vector<Setting>& settings() const { return settings_; }

 private:
  std::vector<Setting> settings_;
};

/// An argument outside its documented range; the message names function, value and range.
class AXISCAL_EXPORT DomainError : public Error {
 public:
  using Error::Error;
};

/// A contradictory or incomplete set-up. It is found before any reading is used.
class AXISCAL_EXPORT SetupError : public DomainError {
 public:
  using DomainError::DomainError;
};

/// A file that is missing, unreadable or malformed. The message starts with the path. The line or
/// the JSON pointer follows if it is known.
class AXISCAL_EXPORT DataError : public Error {
 public:
  /// Message `PATH: what`.
  DataError(std::string_view path, std::string_view what, std::vector<Setting> settings = {});

  /// Message `PATH:LINE: what`. Lines are counted from 1, header and comments included.
  DataError(std::string_view path, std::size_t line, std::string_view what);

  /// Message `PATH: POINTER: what`, for a value in a JSON file. The pointer has the syntax of RFC
  /// 6901, except that `/` is the whole file.
  DataError(std::string_view path, std::string_view pointer, std::string_view what);
};

/// A result that could not be stored: disk full, folder missing, no permission.
class AXISCAL_EXPORT OutputError : public Error {
 public:
  using Error::Error;
};

/// The process that reads our output has closed the pipe (`| head`). This is not a failure.
class AXISCAL_EXPORT ClosedPipe : public OutputError {
 public:
  using OutputError::OutputError;
};

/// An output that would replace a file that this program has read or written (see InputProtection).
class AXISCAL_EXPORT InputOverwriteError : public Error {
 public:
  using Error::Error;
};

/// Valid readings from which no result can be computed, for example because they are too few or
/// have no opposite orientations.
class AXISCAL_EXPORT RefusedError : public Error {
 public:
  using Error::Error;
};

/// A set of readings that does not determine all parameters.
class AXISCAL_EXPORT RankDeficientError : public RefusedError {
 public:
  /// @param what          the message; it should name the missing input.
  /// @param undetermined  names of the parameters that the data do not determine.
  /// @param settings      the settings that would remedy the error.
  RankDeficientError(const std::string& what,
                     std::vector<std::string> undetermined,
                     std::vector<Setting> settings = {})
      : RefusedError(what, std::move(settings)), undetermined_(std::move(undetermined)) {}

  [[nodiscard]] const std::vector<std::string>& undetermined() const { return undetermined_; }

 private:
  std::vector<std::string> undetermined_;
};

}  // namespace axiscal
