// SPDX-License-Identifier: Apache-2.0
#include "acquisition/src/web_request.hpp"

#ifdef AXISCAL_WEB
#include <boost/asio/buffer.hpp>
#include <boost/beast/core/string.hpp>
#include <boost/beast/http/parser.hpp>
#include <boost/beast/http/string_body.hpp>

#include "core/formatted.hpp"

namespace axiscal {

namespace http = boost::beast::http;

namespace {

bool same_name(std::string_view a, std::string_view b) {
  return boost::beast::iequals(boost::beast::string_view(a.data(), a.size()),
                               boost::beast::string_view(b.data(), b.size()));
}

std::string text_of(boost::beast::string_view text) {
  return {text.data(), text.size()};
}

const char* reason_of(int status) {
  switch (status) {
    case 200:
      return "OK";
    case 400:
      return "Bad Request";
    case 403:
      return "Forbidden";
    case 404:
      return "Not Found";
    case 409:
      return "Conflict";
    case 413:
      return "Payload Too Large";
    case 429:
      return "Too Many Requests";
    case 431:
      return "Request Header Fields Too Large";
    default:
      return "Service Unavailable";
  }
}

}  // namespace

std::string WebRequest::header(std::string_view name) const {
  for (const auto& [own, value] : headers) {
    if (same_name(own, name)) {
      return value;
    }
  }
  return "";
}

bool WebRequest::has_header(std::string_view name) const {
  for (const auto& [own, value] : headers) {
    if (same_name(own, name)) {
      return true;
    }
  }
  return false;
}

WebAnswer refusal(int status, std::string_view why) {
  return {.status = status, .body = formatted("{{\"error\":\"{}\"}}", why)};
}

std::string answer_head(const WebAnswer& answer, bool keeps_alive) {
  std::string head = formatted("HTTP/1.1 {} {}\r\nContent-Type: {}\r\n", answer.status,
                               reason_of(answer.status), answer.type);
  head += answer.is_stream ? std::string("Transfer-Encoding: chunked\r\n")
                           : formatted("Content-Length: {}\r\n", answer.body.size());
  for (const auto& [name, value] : answer.headers) {
    head += formatted("{}: {}\r\n", name, value);
  }
  head += formatted(
      "Content-Security-Policy: {}; frame-ancestors 'none'; base-uri 'none'; form-action "
      "'none'\r\n",
      answer.policy.empty() ? "default-src 'none'; script-src 'self'; style-src 'self'; "
                              "connect-src 'self'; img-src 'self' data: blob:"
                            : answer.policy);
  head +=
      "X-Content-Type-Options: nosniff\r\n"
      "Referrer-Policy: no-referrer\r\n"
      "Cross-Origin-Resource-Policy: same-origin\r\n"
      "Cache-Control: no-store\r\n";
  return formatted("{}Connection: {}\r\n\r\n", head, keeps_alive ? "keep-alive" : "close");
}

std::string answer_chunk(const std::string& text) {
  return formatted("{:x}\r\n{}\r\n", text.size(), text);
}

struct RequestReader::Parser {
  http::request_parser<http::string_body> request;
  std::string bytes;  // bytes that are not parsed yet, such as an incomplete line
};

RequestReader::RequestReader() : parser_(std::make_unique<Parser>()) {
  parser_->request.eager(true);
  parser_->request.header_limit(longest_request_head);
  parser_->request.body_limit(longest_request_body);
}

RequestReader::~RequestReader() = default;
RequestReader::RequestReader(RequestReader&&) noexcept = default;
RequestReader& RequestReader::operator=(RequestReader&&) noexcept = default;

RequestReader::State RequestReader::add(std::string_view bytes) {
  std::string& all = parser_->bytes;
  all += bytes;
  boost::beast::error_code error;
  while (!all.empty() && !parser_->request.is_done()) {
    const std::size_t used = parser_->request.put(boost::asio::buffer(all), error);
    all.erase(0, used);
    if (error == http::error::need_more) {
      // The parser's own limit on the head counts only the bytes that it has parsed.
      return all.size() > longest_request_head ? State::too_long : State::needs_more;
    }
    if (error) {
      return error == http::error::header_limit || error == http::error::body_limit
                 ? State::too_long
                 : State::malformed;
    }
    if (used == 0) {
      break;
    }
  }
  return parser_->request.is_done() ? State::complete : State::needs_more;
}

WebRequest RequestReader::take() {
  const http::request<http::string_body> message = parser_->request.release();
  WebRequest request{.method = text_of(message.method_string()),
                     .target = text_of(message.target()),
                     .headers = {},
                     .body = message.body(),
                     .keeps_alive = message.keep_alive()};
  for (const auto& field : message) {
    request.headers.emplace_back(text_of(field.name_string()), text_of(field.value()));
  }
  return request;
}

bool RequestReader::has_more() const {
  return !parser_->bytes.empty();
}

}  // namespace axiscal
#endif
