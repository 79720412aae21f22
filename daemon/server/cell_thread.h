#pragma once
#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <filesystem>
#include <functional>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "daemon/execution/cell_devices.h"
#include "daemon/execution/executor.h"
#include "daemon/execution/journal.h"

/// The executor's thread: the only one that commands motion. Orders come from the socket thread through a
/// queue of at most kQueueMax; answers go back as closures posted to the socket thread. Stops overtake
/// everything: they have a thread of their own.
namespace hilbrush {

/// Hands a closure to the socket thread. Any thread.
using PostToSocketThread = std::function<void(std::function<void()>)>;

/// What to paint, and where its program must come from.
struct PaintOrder {
  std::filesystem::path folder;  ///< program.ply, and for each copy a journal and emissions
  std::string model_sha256, settings_sha256;
  int copy = 1;  ///< journal, emissions.ply; from the second on journal-2, emissions-2.ply, ...
  bool may_create_journal = false;  ///< nothing of this copy has ever been painted
  bool exposes_in_doubt = false;    ///< the operator orders the dots in doubt again
};

/// A file of the order's copy: the first copy's have no number.
std::filesystem::path copy_file(const PaintOrder& order, const char* stem, const char* extension);

/// How far a job is, by its journal.
struct PaintTally {
  std::size_t exposed = 0;
  std::vector<std::uint32_t> in_doubt;  ///< dot indices, in the program's order
};

/// Why an order was not carried out.
struct CellFault {
  std::string sentence;
  bool is_program_at_fault = false;  ///< the job's files are at fault, not the cell
  bool is_for_another_cell =
      false;  ///< nothing is at fault: the daemon runs another cell than the job was made for
};

struct Prepared {
  std::optional<CellFault> fault;
  PaintTally tally;
  std::optional<std::size_t> next;  ///< first exposure still to make; none: nothing is left
  Joints from{};                    ///< where the axes really are
};

class CellThread {
 public:
  static constexpr std::size_t kQueueMax = 16;
  using OnActEnd = std::function<void(std::optional<CellFault>)>;

  /// `devices` and `description` outlive it.
  CellThread(CellDevices& devices, const CellDescription& description, PostToSocketThread post);
  /// Stops, and waits for the thread; nothing is posted any more.
  ~CellThread();
  CellThread(const CellThread&) = delete;
  CellThread& operator=(const CellThread&) = delete;

  /// Laser off, emission disabled, axes stopped; latched until release_stop(). Any thread. @return true if
  /// the laser confirms.
  bool stop_now() noexcept;
  /// The same from a thread of its own, so that a device which does not answer delays no other request: no
  /// pulse is begun any more when this returns, and `on_end` gets whether the laser confirms.
  void stop(std::function<void(bool is_laser_off)> on_end);
  bool is_stop_latched() const { return control_.stop.load(); }
  /// The run ends between two dots. Socket thread, as everything below; callbacks are posted there.
  void pause() { control_.pause.store(true); }
  /// Before a run begins.
  void resume() { control_.pause.store(false); }
  /// Only while nothing runs.
  void release_stop() { control_.stop.store(false); }
  /// True while an order is queued or carried out, as the socket thread knows it.
  bool is_busy() const { return orders_under_way_ > 0; }

  /// Devices connected, their faults cleared, drives on. Nothing moves.
  void clear(OnActEnd on_end);
  /// Axes ready (those that have lost their reference find it now), then the laser's emission armed.
  void arm(OnActEnd on_end);
  /// To the home position: up first, then table, then arm, in the dark.
  void home(OnActEnd on_end);
  /// The laser's emission disarmed: at the end of a job.
  void disarm();
  /// Reads the program and the journal (made at a job's first start), checks where they come from, reads the
  /// true joints.
  void prepare(PaintOrder order, std::function<void(Prepared)> on_end);
  /// Paints what prepare() has read. Progress comes at most ten times a second.
  void paint(std::vector<Joints> approach, std::function<void(std::size_t exposed)> on_progress,
             std::function<void(ExecutionResult, PaintTally)> on_end);
  /// Lets go of what prepare() has read.
  void release();
  /// What the journal of a job that does not run says.
  void inspect(PaintOrder order, std::function<void(std::optional<PaintTally>)> on_end);

 private:
  struct Loaded {
    ExposureProgram program;
    Journal journal;
    Joints from{};
  };
  template <class Work, class Answer>
  void order(Work work, Answer answer);
  void push(std::function<void()> task);
  void run();
  void carry_out_stops();
  Loaded load(const PaintOrder& order) const;
  static PaintTally tally(const Loaded& loaded);
  Joints true_joints() const;
  void check_stop() const;
  void clear_devices();
  void find_references();
  void arm_devices();
  void travel_home();
  void act(std::function<void()> work, OnActEnd on_end);

  CellDevices& devices_;
  const Cell cell_;
  const CellDescription& description_;
  const PostToSocketThread post_;
  ExecutionControl control_;
  int orders_under_way_ = 0;      ///< the socket thread's
  std::optional<Loaded> loaded_;  ///< the executor thread's
  std::mutex mutex_;
  std::condition_variable woken_;
  std::deque<std::function<void()>> tasks_;       ///< guarded by mutex_
  std::vector<std::function<void(bool)>> stops_;  ///< ordered, not yet carried out; guarded by mutex_
  bool is_working_ = false;                       ///< the executor's thread; guarded by mutex_
  bool is_ending_ = false;                        ///< guarded by mutex_
  std::thread thread_, stop_thread_;
};

}  // namespace hilbrush
