#include "sampling/model/vrml/parser.h"

#include <algorithm>
#include <array>
#include <unordered_map>

#include "sampling/base/input_error.h"
#include "sampling/model/vrml/lexer.h"

namespace hilbrush::vrml {
namespace {

// A field and a string cost about as much memory as this many numbers.
constexpr std::size_t kFieldCost = 24;
constexpr std::size_t kStringCost = 8;
constexpr std::size_t kParserWarningLimit = 100;

bool begins_like_number(std::string_view word) {
  return !word.empty() &&
         (word.front() == '+' || word.front() == '-' || (word.front() >= '0' && word.front() <= '9'));
}

/// VRML 1.0: an SFString without a blank in it needs no quotes, and many exporters write file names so.
bool is_unquoted_string(std::string_view field, int version) {
  return version == 1 && (field == "filename" || field == "name");
}

bool is_interface_word(std::string_view word) {
  return word == "field" || word == "exposedField" || word == "eventIn" || word == "eventOut";
}

/// VRML 1.0 by its header; without one by nodes that only 1.0 has.
int version_of(std::string_view text) {
  const std::string_view head = text.substr(0, 64);
  const std::string_view line = head.substr(0, head.find_first_of("\r\n"));
  if (line.find("VRML V1.0") != line.npos) return 1;
  if (line.find("VRML V2.0") != line.npos) return 2;
  return text.find("Separator") != text.npos && text.find("Shape") == text.npos ? 1 : 2;
}

class Parser {
 public:
  Parser(std::string_view text, const std::string& file, const ModelLimits& limits, ParseBudget& budget,
         std::vector<std::string>& warnings)
      : lexer_(text, file),
        file_(std::make_shared<const std::string>(file)),
        limits_(limits),
        budget_(budget),
        warnings_(warnings) {
    scene_.version = version_of(text);
  }

  Scene parse_file() {
    scopes_.emplace_back();
    while (lexer_.peek().kind != TokenKind::kEnd)
      if (NodePointer node = parse_statement("a node at the top of the file"))
        scene_.roots.push_back(std::move(node));
    return std::move(scene_);
  }

 private:
  /// DEF names and PROTOs; a PROTO's body has its own names, and sees the PROTOs around it.
  struct Scope {
    std::unordered_map<std::string, std::shared_ptr<Node>> nodes;
    std::unordered_map<std::string, std::shared_ptr<const Prototype>> prototypes;
  };

  /// Counts one level of nesting while it lives.
  struct Level {
    explicit Level(Parser& parser_in, int line) : parser(parser_in) {
      if (++parser.depth_ > parser.limits_.depth)
        throw InputError(parser.lexer_.at(line),
                         "nodes are nested more than " + std::to_string(parser.limits_.depth) + " deep");
    }
    ~Level() { --parser.depth_; }
    Level(const Level&) = delete;
    Level& operator=(const Level&) = delete;
    Parser& parser;
  };

  [[noreturn]] void fail(const Token& token, const std::string& expected) const {
    throw InputError(lexer_.at(token.line), "expected " + expected + ", found " + describe(token));
  }
  void warn(int line, const std::string& sentence) {
    if (warnings_.size() < kParserWarningLimit) warnings_.push_back(lexer_.at(line) + ": " + sentence);
  }
  void expect(char punctuation, const std::string& where) {
    if (!lexer_.peek().is(punctuation)) fail(lexer_.peek(), std::string("'") + punctuation + "' " + where);
    lexer_.take();
  }
  std::string take_name(const std::string& expected) {
    // Exporters write names that begin with a digit, too.
    const Token token = lexer_.peek();
    if (token.kind != TokenKind::kWord && token.kind != TokenKind::kNumber) fail(token, expected);
    return std::string(lexer_.take().text);
  }
  void spend_values(std::size_t count, int line) {
    budget_.values += count;
    if (budget_.values > limits_.values)
      throw InputError(lexer_.at(line),
                       "the model holds more values than the limit of " + std::to_string(limits_.values));
  }

  NodePointer parse_statement(const std::string& expected) {
    const Token token = lexer_.peek();
    if (token.is_word("PROTO")) {
      parse_prototype();
    } else if (token.is_word("EXTERNPROTO")) {
      parse_external_prototype();
    } else if (token.is_word("ROUTE")) {
      skip_route();
    } else {
      return parse_node(expected);
    }
    return nullptr;
  }

  void skip_route() {
    lexer_.take();
    take_name("the event a ROUTE starts from");
    if (!lexer_.peek().is_word("TO")) fail(lexer_.peek(), "'TO' in the ROUTE");
    lexer_.take();
    take_name("the event a ROUTE goes to");
  }

  NodePointer parse_node(const std::string& expected) {
    const Token token = lexer_.peek();
    if (token.kind != TokenKind::kWord) fail(token, expected);
    lexer_.take();
    if (token.text == "NULL") return nullptr;
    if (token.text == "USE") return use(token.line);
    if (token.text != "DEF") return parse_body(std::string(token.text), "", token.line);

    std::string name = take_name("a name after DEF");
    if (lexer_.peek().is('{')) {
      warn(token.line, "DEF without a name before " + name);
      return parse_body(name, "", token.line);
    }
    if (lexer_.peek().kind != TokenKind::kWord) fail(lexer_.peek(), "a node type after DEF " + name);
    while (lexer_.peek().is_word("DEF")) {
      warn(token.line, "DEF " + name.substr(0, 80) + " is followed by another DEF, which is taken instead");
      lexer_.take();
      name = take_name("a name after DEF");
    }
    if (lexer_.peek().is_word("NULL")) {
      lexer_.take();
      return nullptr;
    }
    return parse_body(std::string(lexer_.take().text), name, token.line);
  }

  NodePointer use(int line) {
    const std::string name = take_name("a name after USE");
    const auto found = scopes_.back().nodes.find(name);
    if (found == scopes_.back().nodes.end()) {
      warn(line, "USE of a name that was never defined: " + name.substr(0, 80));
      return nullptr;
    }
    // A Script may name itself or what it stands in: it controls them, and is not a surface.
    if (found->second->is_open && script_depth_ > 0) return nullptr;
    if (found->second->is_open)
      throw InputError(lexer_.at(line),
                       "USE " + name.substr(0, 80) + " inside its own DEF: the model contains itself");
    return found->second;
  }

  std::shared_ptr<const Prototype> find_prototype(const std::string& type) const {
    for (auto scope = scopes_.rbegin(); scope != scopes_.rend(); ++scope)
      if (const auto found = scope->prototypes.find(type); found != scope->prototypes.end())
        return found->second;
    return nullptr;
  }

  NodePointer parse_body(const std::string& type, const std::string& name, int line) {
    const Level level(*this, line);
    if (++budget_.nodes > limits_.nodes)
      throw InputError(lexer_.at(line),
                       "the model holds more nodes than the limit of " + std::to_string(limits_.nodes));
    auto node = std::make_shared<Node>();
    node->type = type;
    node->file = file_;
    node->line = line;
    node->prototype = find_prototype(type);
    if (!name.empty()) scopes_.back().nodes[name] = node;
    expect('{', "after " + type.substr(0, 80));
    while (!lexer_.peek().is('}')) parse_member(*node);
    lexer_.take();
    node->is_open = false;
    return node;
  }

  /// One field, or whatever else may stand between the braces of a node.
  void parse_member(Node& node) {
    const Token token = lexer_.peek();
    const std::string expected = "a field of " + node.type.substr(0, 80) + " or '}'";
    if (token.kind != TokenKind::kWord) fail(token, expected);
    if (token.text == "PROTO" || token.text == "EXTERNPROTO" || token.text == "ROUTE") {
      parse_statement(expected);
    } else if (is_interface_word(token.text)) {
      ++script_depth_;
      parse_interface_member(node.fields, true);
      --script_depth_;
    } else if (token.text == "DEF" || token.text == "USE") {
      add_child(node, parse_node(expected), token.line);
    } else {
      lexer_.take();
      if (lexer_.peek().is('{'))
        add_child(node, parse_body(std::string(token.text), "", token.line), token.line);
      else
        parse_field(node, token);
    }
  }

  void add_child(Node& node, NodePointer child, int line) {
    if (scene_.version == 2)
      warn(line, "a node stands in " + node.type.substr(0, 80) + " without a field name");
    if (child) node.children.push_back(std::move(child));
  }

  void parse_field(Node& node, const Token& name) {
    spend_values(kFieldCost, name.line);
    Field field;
    field.name = std::string(name.text);
    field.line = name.line;
    // Normals are not used: faces have their own. So whatever stands in their brackets is no fault ("nan").
    const bool is_unused = field.name == "normalIndex" || (node.type == "Normal" && field.name == "vector");
    if (is_unused && lexer_.peek().is('[')) return skip_list();
    parse_value(field);
    if (!is_unused) node.fields.push_back(std::move(field));
  }

  void skip_list() {
    while (!lexer_.peek().is(']')) {
      if (lexer_.peek().kind == TokenKind::kEnd) fail(lexer_.peek(), "']'");
      lexer_.take();
    }
    lexer_.take();
  }

  void parse_value(Field& field) {
    const Token token = lexer_.peek();
    const std::string expected = "a value of " + field.name.substr(0, 80);
    if (token.is_word("IS")) {
      lexer_.take();
      field.is = take_name("a field of the PROTO after IS");
    } else if (token.is('[')) {
      lexer_.take();
      while (!lexer_.peek().is(']')) parse_item(field, "a value of " + field.name.substr(0, 80) + " or ']'");
      lexer_.take();
    } else if (token.is('(')) {
      parse_flags(field.value);
    } else if (is_unquoted_string(field.name, scene_.version) && token.kind == TokenKind::kWord) {
      spend_values(kStringCost, token.line);
      field.value.strings.emplace_back(lexer_.take().text);
    } else if (token.kind == TokenKind::kNumber) {
      while (lexer_.peek().kind == TokenKind::kNumber) parse_item(field, expected);
    } else {
      parse_item(field, expected);
    }
  }

  /// VRML 1.0: (SIDES | TOP).
  void parse_flags(Value& value) {
    lexer_.take();
    while (!lexer_.peek().is(')')) {
      if (lexer_.peek().is('|')) {
        lexer_.take();
        continue;
      }
      spend_values(kStringCost, lexer_.peek().line);
      value.strings.push_back(take_name("a flag or ')'"));
    }
    lexer_.take();
  }

  void parse_item(Field& field, const std::string& expected) {
    const Token& token = lexer_.peek();
    Value& value = field.value;
    if (token.kind == TokenKind::kNumber) {
      spend_values(1, token.line);
      value.numbers.push_back(token.number);
      lexer_.take();
    } else if (token.kind == TokenKind::kString) {
      spend_values(kStringCost, token.line);
      value.strings.push_back(unescape(token.text));
      lexer_.take();
    } else if (token.is_word("TRUE") || token.is_word("FALSE")) {
      value.numbers.push_back(token.is_word("TRUE") ? 1 : 0);
      spend_values(1, token.line);
      lexer_.take();
    } else if (token.kind == TokenKind::kWord) {
      parse_node_or_word(value, expected);
    } else {
      fail(token, expected);
    }
  }

  void parse_node_or_word(Value& value, const std::string& expected) {
    const Token token = lexer_.peek();
    if (token.text == "ROUTE" || token.text == "PROTO" || token.text == "EXTERNPROTO") {
      parse_statement(expected);
      return;
    }
    if (token.text != "DEF" && token.text != "USE" && token.text != "NULL") {
      lexer_.take();
      if (lexer_.peek().is('{')) {
        value.nodes.push_back(parse_body(std::string(token.text), "", token.line));
      } else if (scene_.version == 1 && !begins_like_number(token.text)) {
        spend_values(kStringCost, token.line);
        value.strings.emplace_back(token.text);
      } else {
        fail(token, expected);
      }
      return;
    }
    spend_values(2, token.line);
    if (NodePointer node = parse_node(expected)) value.nodes.push_back(std::move(node));
  }

  /// "field SFFloat radius 1" of a PROTO or a Script; in an EXTERNPROTO without the value.
  void parse_interface_member(std::vector<Field>& fields, bool has_value) {
    const Token kind = lexer_.take();
    const Token type = lexer_.take();
    if (type.kind != TokenKind::kWord) fail(type, "a field type after " + std::string(kind.text));
    spend_values(kFieldCost, kind.line);
    Field field;
    field.line = kind.line;
    field.name = take_name("a name after " + std::string(kind.text));
    const bool is_event = kind.text == "eventIn" || kind.text == "eventOut";
    if (lexer_.peek().is_word("IS") || (has_value && !is_event)) parse_value(field);
    if (!is_event) fields.push_back(std::move(field));
  }

  std::vector<Field> parse_interface(bool has_values) {
    expect('[', "before the fields of the PROTO");
    std::vector<Field> fields;
    while (!lexer_.peek().is(']')) {
      if (!is_interface_word(lexer_.peek().text) || lexer_.peek().kind != TokenKind::kWord)
        fail(lexer_.peek(), "field, exposedField, eventIn, eventOut or ']'");
      parse_interface_member(fields, has_values);
    }
    lexer_.take();
    return fields;
  }

  void parse_prototype() {
    const Token keyword = lexer_.take();
    const Level level(*this, keyword.line);
    auto prototype = std::make_shared<Prototype>();
    prototype->name = take_name("a name after PROTO");
    prototype->defaults = parse_interface(true);
    expect('{', "before the body of PROTO " + prototype->name.substr(0, 80));
    scopes_.emplace_back();
    while (!lexer_.peek().is('}')) {
      NodePointer node = parse_statement("a node or '}' in PROTO " + prototype->name.substr(0, 80));
      if (!prototype->body) prototype->body = std::move(node);
    }
    lexer_.take();
    scopes_.pop_back();
    // Known only from here on, so that a PROTO cannot contain itself.
    scopes_.back().prototypes[prototype->name] = prototype;
  }

  void parse_external_prototype() {
    const Token keyword = lexer_.take();
    auto prototype = std::make_shared<Prototype>();
    prototype->name = take_name("a name after EXTERNPROTO");
    parse_interface(false);
    Field urls;
    urls.name = "EXTERNPROTO " + prototype->name;
    parse_value(urls);
    warn(keyword.line,
         "EXTERNPROTO " + prototype->name.substr(0, 80) + " is not read: nodes of that type are left out");
    scopes_.back().prototypes[prototype->name] = prototype;
  }

  Lexer lexer_;
  std::shared_ptr<const std::string> file_;
  const ModelLimits& limits_;
  ParseBudget& budget_;
  std::vector<std::string>& warnings_;
  std::vector<Scope> scopes_;
  Scene scene_;
  int depth_ = 0;
  int script_depth_ = 0;  ///< Scripts whose fields are being read
};

}  // namespace

Scene parse(std::string_view text, const std::string& file, const ModelLimits& limits, ParseBudget& budget,
            std::vector<std::string>& warnings) {
  if (text.substr(0, 3) == "\xef\xbb\xbf") text.remove_prefix(3);
  return Parser(text, file, limits, budget, warnings).parse_file();
}

}  // namespace hilbrush::vrml
