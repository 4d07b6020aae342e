// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <memory>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace axiscal {

/// The largest sizes of a request's head (first line and headers) and of its body [bytes].
inline constexpr std::size_t longest_request_head = 8192;
inline constexpr std::size_t longest_request_body = 4096;

/// A complete request of HTTP/1.1.
struct WebRequest {
  std::string method;  ///< "GET", ...
  std::string target;  ///< path and query, as sent
  std::vector<std::pair<std::string, std::string>> headers;
  std::string body;
  bool keeps_alive = false;  ///< true if the connection may stay open for more requests

  /// @return the value of a header; empty if it is missing. Names are case-insensitive.
  [[nodiscard]] std::string header(std::string_view name) const;
  [[nodiscard]] bool has_header(std::string_view name) const;
};

/// The answer to a request.
struct WebAnswer {
  int status = 200;
  std::string type = "application/json";
  std::string body = "{}";
  std::vector<std::pair<std::string, std::string>> headers;
  std::string policy;      ///< Content-Security-Policy; if empty, the policy of the session's page
  bool is_stream = false;  ///< true: a stream of events follows instead of the body
  std::string session;     ///< session of the browser that receives the stream
  std::size_t last_event = 0;  ///< number of the last event that this browser has received
};

/// @return an error answer with its reason.
[[nodiscard]] WebAnswer refusal(int status, std::string_view why);

/// @return an answer's first line and headers, with the security restrictions for the browser.
[[nodiscard]] std::string answer_head(const WebAnswer& answer, bool keeps_alive);

/// @return a text as one chunk of a chunked HTTP body. An empty text gives the final chunk.
[[nodiscard]] std::string answer_chunk(const std::string& text);

/// Parses a request from bytes as they arrive, by Boost.Beast with limits on head and body.
class RequestReader {
 public:
  RequestReader();
  ~RequestReader();
  RequestReader(RequestReader&&) noexcept;
  RequestReader& operator=(RequestReader&&) noexcept;

  enum class State { needs_more, complete, malformed, too_long };

  /// Parses the next bytes. Must be called until it returns a state other than needs_more.
  State add(std::string_view bytes);

  /// @return the request, after add() has returned complete.
  [[nodiscard]] WebRequest take();

  /// @return true if bytes follow the end of the request.
  [[nodiscard]] bool has_more() const;

 private:
  struct Parser;
  std::unique_ptr<Parser> parser_;
};

}  // namespace axiscal
