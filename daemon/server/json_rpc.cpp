#include "daemon/server/json_rpc.h"

#include <algorithm>
#include <array>

namespace hilbrush {
namespace {

std::string dump(const Json& json) {
  return json.dump(-1, ' ', false, Json::error_handler_t::replace);
}

/// A cheap look at what stands outside strings, before parsing: values deeper than any of ours only serve to
/// exhaust a stack, objects with more members only to take time. @return a sentence, or nothing.
std::string excess(std::string_view text) {
  std::array<int, kRpcDepthMax + 1> members{};
  std::size_t depth = 0;
  bool is_in_string = false;
  for (std::size_t i = 0; i < text.size(); ++i) {
    const char c = text[i];
    if (is_in_string) {
      if (c == '\\')
        ++i;
      else if (c == '"')
        is_in_string = false;
    } else if (c == '"') {
      is_in_string = true;
    } else if (c == '[' || c == '{') {
      if (++depth > kRpcDepthMax)
        return "the message is nested more than " + std::to_string(kRpcDepthMax) + " deep";
      members[depth] = 0;
    } else if (c == ']' || c == '}') {
      if (depth > 0) --depth;
    } else if (c == ':' && ++members[depth] > kRpcMembersMax) {
      return "an object has at most " + std::to_string(kRpcMembersMax) + " members";
    }
  }
  return {};
}

RpcElement element_of(const Json& json) {
  if (!json.is_object()) return {RpcFault{kRpcInvalidRequest, "a request is a JSON object", "$"}, nullptr};
  Json id = nullptr;
  const bool has_id = json.contains("id");
  if (has_id) {
    id = json["id"];
    if (!id.is_string() && !id.is_number() && !id.is_null())
      return {RpcFault{kRpcInvalidRequest, "an id is a string or a number", "$.id"}, nullptr};
    if (id.is_string() && id.get_ref<const std::string&>().size() > 1000)
      return {RpcFault{kRpcInvalidRequest, "an id has at most 1000 bytes", "$.id"}, nullptr};
  }
  const auto fault = [&](const char* message, const char* at) {
    return RpcElement{RpcFault{kRpcInvalidRequest, message, at}, id};
  };
  if (json.value("jsonrpc", Json()) != "2.0") return fault("\"jsonrpc\" must be \"2.0\"", "$.jsonrpc");
  if (!json.contains("method") || !json["method"].is_string())
    return fault("\"method\" must be a string", "$.method");
  RpcRequest request;
  request.id = id;
  request.is_notification = !has_id;
  request.method = json["method"].get<std::string>();
  if (json.contains("params")) request.params = json["params"];
  if (!request.params.is_object())
    return {RpcFault{kRpcBadParams, "params are given by name, as an object", "$"}, id};
  return {std::move(request), id};
}

const char* type_name(const Json& value) {
  if (value.is_object()) return "object";
  if (value.is_array()) return "array";
  if (value.is_string()) return "string";
  if (value.is_boolean()) return "boolean";
  if (value.is_number_integer()) return "integer";
  if (value.is_number()) return "number";
  return "null";
}

bool fits_type(const Json& value, const Json& type) {
  if (type.is_array())
    return std::any_of(type.begin(), type.end(), [&](const Json& one) { return fits_type(value, one); });
  const auto name = type.get<std::string>();
  return name == type_name(value) || (name == "number" && value.is_number());
}

std::optional<RpcFault> check_object(const Json& value, const Json& schema, const std::string& at) {
  if (schema.contains("required"))
    for (const auto& name : schema["required"])
      if (!value.contains(name.get<std::string>()))
        return RpcFault{kRpcBadParams, "is required", at + "." + name.get<std::string>()};
  const Json properties = schema.value("properties", Json::object());
  for (const auto& [name, member] : value.items()) {
    if (properties.contains(name)) {
      std::string place = at;
      place.append(".").append(name);
      if (auto fault = check_schema(member, properties[name], place)) return fault;
    } else if (schema.value("additionalProperties", true) == false) {
      return RpcFault{kRpcBadParams, "is not known here", at + "." + name.substr(0, 100)};
    }
  }
  return std::nullopt;
}

}  // namespace

RpcMessage parse_rpc(std::string_view line) {
  RpcMessage message;
  const auto refuse = [&](int code, std::string sentence) {
    message.elements.push_back({RpcFault{code, std::move(sentence), ""}, nullptr});
    return message;
  };
  if (std::string sentence = excess(line); !sentence.empty()) return refuse(kRpcParse, std::move(sentence));
  Json json;
  try {
    json = Json::parse(line);
  } catch (const Json::parse_error& error) {
    return refuse(kRpcParse, "the message is not JSON: wrong at byte " + std::to_string(error.byte));
  } catch (const Json::exception&) {
    return refuse(kRpcParse, "the message is not JSON: a number is out of range");
  }
  if (!json.is_array()) {
    message.elements.push_back(element_of(json));
    return message;
  }
  if (json.empty()) return refuse(kRpcInvalidRequest, "a batch must not be empty");
  if (json.size() > kRpcBatchMax)
    return refuse(kRpcInvalidRequest, "a batch has at most " + std::to_string(kRpcBatchMax) + " requests");
  message.is_batch = true;
  for (const auto& one : json) message.elements.push_back(element_of(one));
  return message;
}

std::string rpc_result(const Json& id, Json result) {
  return dump({{"jsonrpc", "2.0"}, {"id", id}, {"result", std::move(result)}});
}

std::string rpc_fault(const Json& id, const RpcFault& fault) {
  Json error{{"code", fault.code}, {"message", fault.message}};
  if (!fault.at.empty()) error["data"] = {{"at", fault.at}};
  return dump({{"jsonrpc", "2.0"}, {"id", id}, {"error", std::move(error)}});
}

std::string rpc_notification(const std::string& method, Json params) {
  return dump({{"jsonrpc", "2.0"}, {"method", method}, {"params", std::move(params)}});
}

std::optional<RpcFault> check_schema(const Json& value, const Json& schema, const std::string& at) {
  const auto fault = [&](const std::string& sentence) { return RpcFault{kRpcBadParams, sentence, at}; };
  if (schema.contains("type") && !fits_type(value, schema["type"]))
    return fault("must be " + dump(schema["type"]) + ", not " + type_name(value));
  if (schema.contains("const") && value != schema["const"]) return fault("must be " + dump(schema["const"]));
  if (schema.contains("enum") &&
      std::find(schema["enum"].begin(), schema["enum"].end(), value) == schema["enum"].end())
    return fault("must be one of " + dump(schema["enum"]));
  if (value.is_string()) {
    const auto length = value.get_ref<const std::string&>().size();
    if (length < schema.value("minLength", std::size_t{0})) return fault("must not be empty");
    if (length > schema.value("maxLength", std::size_t{1} << 20)) return fault("is too long");
  }
  if (value.is_number()) {
    if (schema.contains("minimum") && value < schema["minimum"])
      return fault("must be at least " + dump(schema["minimum"]));
    if (schema.contains("maximum") && value > schema["maximum"])
      return fault("must be at most " + dump(schema["maximum"]));
  }
  return value.is_object() ? check_object(value, schema, at) : std::nullopt;
}

}  // namespace hilbrush
