#pragma once

/// Error codes of the JSON-RPC socket, shared by the daemon and the operator's command. The first five are
/// JSON-RPC 2.0's own.
namespace hilbrush {

enum RpcError : int {
  kRpcParse = -32700,           ///< the line is not JSON
  kRpcInvalidRequest = -32600,  ///< JSON, but not a request
  kRpcUnknownMethod = -32601,
  kRpcBadParams = -32602,  ///< data.at: the JSON path
  kRpcInternal = -32000,   ///< a fault of the daemon
  kRpcNoSuchJob = -32001,
  kRpcWrongState = -32002,  ///< the message names the state that forbids the request
  kRpcBadInput = -32003,    ///< model, settings or cell; data.at: file:line or JSON path
  kRpcDeviceFault = -32004,
  kRpcNotPermitted = -32005
};

}  // namespace hilbrush
