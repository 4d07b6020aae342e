// SPDX-License-Identifier: Apache-2.0
#include "axiscal/core/json_members.hpp"

namespace axiscal {
namespace {

std::vector<int> integers_of(const JsonValue& list) {
  std::vector<int> values;
  for (const JsonValue& element : list.elements()) {
    values.push_back(element.integer());
  }
  return values;
}

}  // namespace

void JsonMembers::need(const char* key, std::string& text) {
  if (reads()) {
    text = from_->at(key).text();
  } else {
    (*to_)[key] = text;
  }
}

void JsonMembers::need(const char* key, double& number) {
  if (reads()) {
    number = from_->at(key).number();
  } else {
    (*to_)[key] = number;
  }
}

void JsonMembers::need(const char* key, int& number) {
  if (reads()) {
    number = from_->at(key).integer();
  } else {
    (*to_)[key] = number;
  }
}

void JsonMembers::need(const char* key, bool& flag) {
  if (reads()) {
    flag = from_->at(key).boolean();
  } else {
    (*to_)[key] = flag;
  }
}

void JsonMembers::need(const char* key, std::vector<std::string>& texts) {
  if (reads()) {
    texts = from_->at(key).texts();
  } else {
    (*to_)[key] = texts;
  }
}

void JsonMembers::need(const char* key, std::vector<int>& numbers) {
  if (reads()) {
    numbers = integers_of(from_->at(key));
  } else {
    (*to_)[key] = numbers;
  }
}

void JsonMembers::text(const char* key, std::string& text) {
  if (reads()) {
    text = from_->text_or(key, text);
  } else {
    (*to_)[key] = text;
  }
}

void JsonMembers::text_if_any(const char* key, std::string& text) {
  if (reads() || !text.empty()) {
    this->text(key, text);
  }
}

void JsonMembers::number(const char* key, double& number) {
  if (reads()) {
    const std::optional<JsonValue> value = from_->find(key);
    number = value ? value->number() : not_a_number;
  } else {
    (*to_)[key] = number;
  }
}

void JsonMembers::number_if_any(const char* key, double& number) {
  if (!reads()) {
    if (number > 0.0 || number < 0.0) {
      (*to_)[key] = number;
    }
  } else if (const std::optional<JsonValue> value = from_->find(key)) {
    number = value->number();
  }
}

void JsonMembers::number_if_any(const char* key, std::optional<double>& number) {
  if (!reads()) {
    if (number) {
      (*to_)[key] = *number;
    }
  } else if (const std::optional<JsonValue> value = from_->find(key)) {
    number = value->number();
  }
}

void JsonMembers::integer(const char* key, int& number) {
  if (!reads()) {
    (*to_)[key] = number;
  } else if (const std::optional<JsonValue> value = from_->find(key)) {
    number = value->integer();
  }
}

void JsonMembers::integer_if_any(const char* key, std::optional<int>& number) {
  if (!reads()) {
    if (number) {
      (*to_)[key] = *number;
    }
  } else if (const std::optional<JsonValue> value = from_->find(key)) {
    number = value->integer();
  }
}

void JsonMembers::flag(const char* key, bool& flag) {
  if (!reads()) {
    (*to_)[key] = flag;
  } else if (const std::optional<JsonValue> value = from_->find(key)) {
    flag = value->boolean();
  }
}

void JsonMembers::flag_unless(const char* key, bool& flag, bool usual) {
  if (reads() || flag != usual) {
    this->flag(key, flag);
  }
}

void JsonMembers::texts(const char* key, std::vector<std::string>& texts) {
  if (!reads()) {
    (*to_)[key] = texts;
  } else if (const std::optional<JsonValue> value = from_->find(key)) {
    texts = value->texts();
  }
}

void JsonMembers::integers(const char* key, std::vector<int>& numbers) {
  if (!reads()) {
    (*to_)[key] = numbers;
  } else if (const std::optional<JsonValue> value = from_->find(key)) {
    numbers = integers_of(*value);
  }
}

void JsonMembers::integers_if_any(const char* key, std::vector<int>& numbers) {
  if (reads() || !numbers.empty()) {
    integers(key, numbers);
  }
}

void JsonMembers::xy(const char* key, double& x, double& y) {
  if (reads() && !from_->find(key)) {
    x = not_a_number;
    y = not_a_number;
  }
  object(key, true, [&](JsonMembers& io) {
    io.number("x", x);
    io.number("y", y);
  });
}

void JsonMembers::need_pair(const char* key, double& low, double& high) {
  if (!reads()) {
    (*to_)[key] = {low, high};
    return;
  }
  const Eigen::VectorXd ends = from_->at(key).vector(2);
  low = ends(0);
  high = ends(1);
}

}  // namespace axiscal
