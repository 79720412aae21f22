#include "sampling/model/vrml/lexer.h"

#include <charconv>
#include <cmath>

#include "sampling/base/input_error.h"

namespace hilbrush::vrml {
namespace {

constexpr std::size_t kQuotedLength = 40;

bool is_blank(char c) {
  return c == ' ' || c == '\t' || c == '\n' || c == '\r' || c == ',' || c == '\0' || c == '\f';
}
bool is_digit(char c) {
  return c >= '0' && c <= '9';
}
bool is_punctuation(char c) {
  return c == '{' || c == '}' || c == '[' || c == ']' || c == '(' || c == ')' || c == '|';
}
bool ends_word(char c) {
  return is_blank(c) || is_punctuation(c) || c == '"' || c == '#';
}

/// Bytes of the file in a message: short, printable.
std::string quoted(std::string_view text) {
  std::string out = "'";
  for (char c : text.substr(0, kQuotedLength)) out += c >= ' ' && c < 127 ? c : '?';
  return out + (text.size() > kQuotedLength ? "...'" : "'");
}

}  // namespace

Lexer::Lexer(std::string_view text, std::string file) : text_(text), file_(std::move(file)) {
  read_token();
}

Token Lexer::take() {
  const Token taken = token_;
  read_token();
  return taken;
}

void Lexer::count_line_end() {
  // CR LF counts once, at its LF.
  const char c = text_[next_];
  if (c == '\n' || (c == '\r' && (next_ + 1 >= text_.size() || text_[next_ + 1] != '\n'))) ++line_;
}

void Lexer::skip_blanks() {
  while (next_ < text_.size()) {
    if (text_[next_] == '#') {
      while (next_ < text_.size() && text_[next_] != '\n' && text_[next_] != '\r') ++next_;
    } else if (is_blank(text_[next_])) {
      count_line_end();
      ++next_;
    } else {
      return;
    }
  }
}

void Lexer::read_token() {
  skip_blanks();
  token_ = Token();
  token_.line = line_;
  if (next_ >= text_.size()) return;
  const char c = text_[next_];
  const char second = next_ + 1 < text_.size() ? text_[next_ + 1] : ' ';
  if (c == '"') {
    read_string();
  } else if (is_punctuation(c)) {
    token_.kind = TokenKind::kPunctuation;
    token_.text = text_.substr(next_, 1);
    ++next_;
  } else if (is_digit(c) || ((c == '+' || c == '-') && (is_digit(second) || second == '.')) ||
             (c == '.' && is_digit(second))) {
    read_number();
  } else {
    const std::size_t start = next_;
    while (next_ < text_.size() && !ends_word(text_[next_])) ++next_;
    token_.kind = TokenKind::kWord;
    token_.text = text_.substr(start, next_ - start);
  }
}

void Lexer::read_string() {
  const std::size_t start = ++next_;
  while (next_ < text_.size() && text_[next_] != '"') {
    if (text_[next_] == '\\' && next_ + 1 < text_.size()) {
      count_line_end();
      ++next_;
    }
    count_line_end();
    ++next_;
  }
  if (next_ >= text_.size())
    throw InputError(at(token_.line), "the string that starts here has no closing quote");
  token_.kind = TokenKind::kString;
  token_.text = text_.substr(start, next_ - start);
  ++next_;
}

void Lexer::read_number() {
  const std::size_t start = next_;
  while (next_ < text_.size() && !ends_word(text_[next_])) ++next_;
  const std::string_view text = text_.substr(start, next_ - start);
  token_.kind = TokenKind::kNumber;
  token_.text = text;

  std::string_view digits = text;
  if (digits.front() == '+') digits.remove_prefix(1);
  const char* end = digits.data() + digits.size();
  std::from_chars_result result{};
  if (digits.size() > 2 && digits[0] == '0' && (digits[1] == 'x' || digits[1] == 'X')) {
    std::uint64_t hexadecimal = 0;
    result = std::from_chars(digits.data() + 2, end, hexadecimal, 16);
    token_.number = static_cast<double>(hexadecimal);
  } else {
    result = std::from_chars(digits.data(), end, token_.number);
    const bool is_tiny = digits.find("e-") != digits.npos || digits.find("E-") != digits.npos;
    if (result.ec == std::errc::result_out_of_range && is_tiny) {
      token_.number = 0;
      result.ec = {};
    }
  }
  const bool is_number = result.ptr == end;
  if (is_number && (result.ec == std::errc::result_out_of_range || !std::isfinite(token_.number)))
    throw InputError(at(token_.line), "the number " + quoted(text) + " is out of range");
  // File names without quotes (VRML 1.0) and DEF names may begin like numbers.
  if (result.ec != std::errc() || result.ptr != end) token_.kind = TokenKind::kWord;
}

std::string describe(const Token& token) {
  switch (token.kind) {
    case TokenKind::kEnd:
      return "the end of the file";
    case TokenKind::kString:
      return "the string " + quoted(token.text);
    case TokenKind::kNumber:
      return "the number " + std::string(token.text.substr(0, kQuotedLength));
    default:
      return quoted(token.text);
  }
}

std::string unescape(std::string_view text) {
  std::string out;
  out.reserve(text.size());
  for (std::size_t i = 0; i < text.size(); ++i) {
    if (text[i] == '\\' && i + 1 < text.size() && (text[i + 1] == '"' || text[i + 1] == '\\')) ++i;
    out += text[i];
  }
  return out;
}

}  // namespace hilbrush::vrml
