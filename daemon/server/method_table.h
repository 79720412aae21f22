#pragma once
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "daemon/server/audit_log.h"
#include "daemon/server/cell_controller.h"
#include "daemon/server/job_painting.h"
#include "daemon/server/job_planning.h"
#include "daemon/server/job_queue.h"
#include "daemon/server/json_rpc.h"

/// Every method of the socket in one table: its name, what it does, the schemas of its parameters and result,
/// and its handler. Requests are dispatched and checked by it, and rpc.discover prints it, so that the three
/// cannot differ. Socket thread only.
namespace hilbrush {

/// The connection a request came over.
struct Caller {
  Peer peer;
  /// The connection takes the identity of the token's owner; if there is none, it is closed after the answer.
  std::function<std::optional<Peer>(const std::string& token)> identify;
  std::function<void(std::int64_t job)> watch, unwatch;
};

/// What a caller must be allowed to do.
enum class Right { kNone, kLook, kOperate };

struct Method {
  std::string name, summary;
  bool is_act = false;  ///< recorded in the audit log
  Json params, result;  ///< JSON schemas
  std::function<void(const Json& params, const Caller& caller, Reply reply)> handler;
  /// Looking needs the right to look, acts need the right to operate; but a peer that may look may also stop
  /// the cell.
  Right right() const;
};

/// What the methods of jobs are served by.
struct Jobs {
  JobQueue& queue;
  JobPlanning& planning;
  JobPainting& painting;
};

class MethodTable {
 public:
  /// `info` answers system.info. All others outlive the table.
  MethodTable(const Jobs& jobs, CellController& controller, AuditLog& audit, std::function<Json()> info);

  /// Answers once, now or later.
  void dispatch(const RpcRequest& request, const Caller& caller, Reply reply) const;
  /// OpenRPC 1.2.6.
  Json discover() const;
  const std::vector<Method>& methods() const { return methods_; }
  /// False for a method that is not in the table, too.
  bool is_act(const std::string& name) const;
  /// May a connection that has not said who it is ask for this?
  bool is_open_to_strangers(const std::string& name) const;

 private:
  const Method* find(const std::string& name) const;
  void add_job_acts(const Jobs& jobs);
  void add_job_views(JobQueue& queue);
  void add_cell_methods(CellController& controller);
  void add_system_methods(std::function<Json()> info);
  void add_session_method();

  AuditLog& audit_;
  std::vector<Method> methods_;
};

}  // namespace hilbrush
