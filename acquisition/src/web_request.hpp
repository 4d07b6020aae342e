// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <memory>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace axiscal {

/// The most that is taken of a request: its first line and headers, and its body.
inline constexpr std::size_t longest_request_head = 8192;
inline constexpr std::size_t longest_request_body = 4096;

/// A request of HTTP/1.1, read whole.
struct WebRequest {
  std::string method;  ///< "GET", ...
  std::string target;  ///< path and query, as sent
  std::vector<std::pair<std::string, std::string>> headers;
  std::string body;
  bool keeps_alive = false;  ///< the client may ask again on this connection

  /// @return the value of a header, whatever its letters' case; empty where there is none.
  [[nodiscard]] std::string header(std::string_view name) const;
  [[nodiscard]] bool has_header(std::string_view name) const;
};

/// The answer to a request.
struct WebAnswer {
  int status = 200;
  std::string type = "application/json";
  std::string body = "{}";
  std::vector<std::pair<std::string, std::string>> headers;
  std::string policy;          ///< Content-Security-Policy; empty: the session's page's
  bool is_stream = false;      ///< events follow instead of the body
  std::string session;         ///< names the browser that a stream is for
  std::size_t last_event = 0;  ///< the last one that this browser has seen
};

/// @return an answer that says why nothing else is.
[[nodiscard]] WebAnswer refusal(int status, std::string_view why);

/// @return an answer's first line and headers, with the security restrictions for the browser.
[[nodiscard]] std::string answer_head(const WebAnswer& answer, bool keeps_alive);

/// @return a part of a body whose length is not known beforehand; of an empty text the end.
[[nodiscard]] std::string answer_chunk(const std::string& text);

/// Makes a request of bytes as they come: Boost.Beast's parser with limits on head and body.
class RequestReader {
 public:
  RequestReader();
  ~RequestReader();
  RequestReader(RequestReader&&) noexcept;
  RequestReader& operator=(RequestReader&&) noexcept;

  enum class State { needs_more, complete, malformed, too_long };

  /// Takes the next bytes; to be called until it says something else than needs_more.
  State add(std::string_view bytes);

  /// @return the request once it is complete.
  [[nodiscard]] WebRequest take();

  /// @return whether bytes came behind the request's end: another one, or noise.
  [[nodiscard]] bool has_more() const;

 private:
  struct Parser;
  std::unique_ptr<Parser> parser_;
};

}  // namespace axiscal
