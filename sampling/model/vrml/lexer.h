#pragma once
#include <cstdint>
#include <string>
#include <string_view>

/// VRML text to tokens, for versions 1.0 and 2.0 alike. Commas are white space, comments are skipped, lines
/// are counted at LF, CR and CR LF. Bytes above 127 may stand in names and strings.
namespace hilbrush::vrml {

enum class TokenKind { kWord, kNumber, kString, kPunctuation, kEnd };

struct Token {
  TokenKind kind = TokenKind::kEnd;
  std::string_view text;  ///< as in the file; of a string without its quotes, escapes still in it
  double number = 0;      ///< of a number; finite
  int line = 1;

  bool is(char punctuation) const { return kind == TokenKind::kPunctuation && text.front() == punctuation; }
  bool is_word(std::string_view word) const { return kind == TokenKind::kWord && text == word; }
};

class Lexer {
 public:
  /// Keeps a view of `text`, which must outlive it; `file` is only for messages.
  Lexer(std::string_view text, std::string file);

  const Token& peek() const { return token_; }
  /// Returns the current token and reads the next one.
  /// @throws InputError "file:line" at a string without end, or at what begins like a number
  /// and is not a finite one.
  Token take();

  const std::string& file() const { return file_; }
  /// "file:line" for messages.
  std::string at(int line) const { return file_ + ":" + std::to_string(line); }

 private:
  void skip_blanks();
  void read_token();
  void read_string();
  void read_number();
  void count_line_end();

  std::string_view text_;
  std::string file_;
  std::size_t next_ = 0;
  int line_ = 1;
  Token token_;
};

/// The token as a message names it: 'word', the number 12, the end of the file, ...
std::string describe(const Token& token);

/// A string's text with \" and \\ resolved.
std::string unescape(std::string_view text);

}  // namespace hilbrush::vrml
