#pragma once
#include <cstdint>
#include <functional>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "config/rpc_errors.h"

/// JSON-RPC 2.0 messages: text in, requests out; results and faults in, text out. Pure functions, any thread.
/// Bytes are untrusted.
namespace hilbrush {

using Json = nlohmann::ordered_json;

/// A request that cannot be answered with a result: becomes the reply's "error".
struct RpcFault {
  int code = kRpcInternal;
  std::string message;
  std::string at;  ///< data.at: file:line or JSON path; left out if empty
};

struct RpcRequest {
  Json id;                       ///< string, number or null; discarded for a notification
  bool is_notification = false;  ///< no reply is wanted
  std::string method;
  Json params = Json::object();
};

/// One element of a message: a request, or the fault that keeps it from being one, with the id if there is
/// one.
struct RpcElement {
  std::variant<RpcRequest, RpcFault> content;
  Json id;
};

struct RpcMessage {
  std::vector<RpcElement> elements;
  bool is_batch = false;
};

inline constexpr std::size_t kRpcBatchMax = 64;
inline constexpr int kRpcDepthMax = 32;
inline constexpr int kRpcMembersMax = 500;  ///< of an object: parsing takes time by the square of it

/// Never throws: everything that is wrong becomes a fault among the elements.
RpcMessage parse_rpc(std::string_view line);

std::string rpc_result(const Json& id, Json result);
std::string rpc_fault(const Json& id, const RpcFault& fault);
std::string rpc_notification(const std::string& method, Json params);

/// Checks `value` against the subset of JSON Schema that the method table uses: type, properties, required,
/// additionalProperties, enum, const, minLength, maxLength, minimum, maximum. The fault's `at` is the JSON
/// path.
std::optional<RpcFault> check_schema(const Json& value, const Json& schema, const std::string& at = "$");

}  // namespace hilbrush
