#include "detect/tile_team.hpp"

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <deque>
#include <exception>
#include <mutex>
#include <thread>

#include "base/tool_error.hpp"

namespace cairn::ground {
namespace {

using std::chrono::milliseconds;

// What ranks say to each other; the first byte of a message.
enum class Word : std::uint8_t {
  kRound,   // from 0: tile size, input, tiles
  kEnd,     // from 0: no more
  kRecord,  // to 0: tile, record
  kFailed,  // to 0: why
  kBye,     // to 0: heard kEnd
};

struct Record {
  std::uint32_t tile = 0;
  Bytes bytes;
};

/// Threads that take tiles from a list; their records wait in a queue of bounded length.
class Workers {
 public:
  Workers(const TileJob& job, const RoundInput& input, std::vector<std::uint32_t> tiles, int threads)
      : job_(job), input_(input), tiles_(std::move(tiles)) {
    const std::size_t wanted = std::min(static_cast<std::size_t>(threads), tiles_.size());
    room_ = 2 * wanted + 2;
    working_ = wanted;
    for (std::size_t i = 0; i < wanted; ++i) threads_.emplace_back([this] { work(); });
  }
  ~Workers() {
    cancel();
    {
      const std::lock_guard lock(guard_);
      room_ = static_cast<std::size_t>(-1);
    }
    has_room_.notify_all();
    for (std::thread& thread : threads_) thread.join();
  }
  Workers(const Workers&) = delete;
  Workers& operator=(const Workers&) = delete;

  /// No further tile is begun.
  void cancel() { cancelled_ = true; }
  /// The next record, after waiting for it. False: none came. Throws what a thread threw.
  bool pop(Record& record, milliseconds wait) {
    std::unique_lock lock(guard_);
    has_record_.wait_for(lock, wait, [this] { return !queue_.empty() || fault_ || working_ == 0; });
    if (fault_) std::rethrow_exception(fault_);
    if (queue_.empty()) return false;
    record = std::move(queue_.front());
    queue_.pop_front();
    has_room_.notify_one();
    return true;
  }
  /// All threads have ended and all records are taken.
  bool done() {
    const std::lock_guard lock(guard_);
    return working_ == 0 && queue_.empty() && !fault_;
  }

 private:
  void work() {
    try {
      const std::unique_ptr<RasterReader> reader = job_.source.reader();
      for (std::size_t i = next_++; i < tiles_.size() && !cancelled_; i = next_++) {
        Record record{tiles_[i], work_on_tile(*reader, job_.source.facts(), job_.detection, input_,
                                              job_.grid.box(tiles_[i]))};
        std::unique_lock lock(guard_);
        has_room_.wait(lock, [this] { return queue_.size() < room_; });
        queue_.push_back(std::move(record));
        has_record_.notify_one();
      }
    } catch (...) {
      cancelled_ = true;
      const std::lock_guard lock(guard_);
      if (!fault_) fault_ = std::current_exception();
    }
    const std::lock_guard lock(guard_);
    --working_;
    has_record_.notify_one();
  }

  const TileJob& job_;
  const RoundInput& input_;
  std::vector<std::uint32_t> tiles_;
  std::atomic<std::size_t> next_{0};
  std::atomic<bool> cancelled_{false};
  std::mutex guard_;
  std::condition_variable has_record_;
  std::condition_variable has_room_;
  std::deque<Record> queue_;
  std::size_t room_ = 0;
  std::size_t working_ = 0;
  std::exception_ptr fault_;
  std::vector<std::thread> threads_;
};

Bytes message_of(Word word) { return {static_cast<std::uint8_t>(word)}; }

Bytes record_message(const Record& record) {
  Bytes message = message_of(Word::kRecord);
  ByteWriter writer(message);
  writer.put(record.tile);
  writer.put_bytes(record.bytes.data(), record.bytes.size());
  return message;
}

Bytes failure_message(const std::string& why) {
  Bytes message = message_of(Word::kFailed);
  ByteWriter(message).put_bytes(why.data(), why.size());
  return message;
}

}  // namespace

TileTeam::TileTeam(const TileJob& job, int threads, const MpiRanks& ranks)
    : job_(job), threads_(threads), ranks_(ranks) {}

TileLead::~TileLead() {
  try {
    for (int rank = 1; rank < ranks_.size(); ++rank) ranks_.send(rank, message_of(Word::kEnd));
    Bytes message;
    int from = 0;
    for (int left = ranks_.size() - 1; left > 0;) {
      if (!ranks_.receive(message, from)) {
        std::this_thread::sleep_for(milliseconds(1));
      } else if (message.at(0) == static_cast<std::uint8_t>(Word::kBye)) {
        --left;
      }
    }
  } catch (...) {  // what is told on the way out is told to those that still listen
    return;
  }
}

void TileTeam::tell(std::size_t rank, const RoundInput& input,
                    const std::vector<std::uint32_t>& tiles) const {
  Bytes message = message_of(Word::kRound);
  ByteWriter writer(message);
  writer.put(job_.grid);
  writer.put_all(tiles);
  const Bytes about = to_bytes(input);
  writer.put_bytes(about.data(), about.size());
  ranks_.send(static_cast<int>(rank), message);
}

bool TileTeam::take_message(const TakeRecord& take) {
  Bytes message;
  int from = 0;
  if (!ranks_.receive(message, from)) return false;
  ByteReader reader(message);
  const auto word = reader.get<Word>();
  if (word == Word::kFailed) throw ToolError("{}", std::string(message.begin() + 1, message.end()));
  const auto tile = reader.get<std::uint32_t>();
  take(tile, Bytes(message.begin() + 1 + sizeof tile, message.end()));
  return true;
}

bool TileTeam::run(const RoundInput& input, const std::vector<std::uint32_t>& todo, const TakeRecord& take,
                   const std::function<bool()>& stop) {
  std::vector<std::vector<std::uint32_t>> share(static_cast<std::size_t>(ranks_.size()));
  for (std::size_t i = 0; i < todo.size(); ++i) share[i % share.size()].push_back(todo[i]);
  std::size_t from_others = todo.size() - share[0].size();
  for (std::size_t rank = 1; rank < share.size(); ++rank) tell(rank, input, share[rank]);

  Workers workers(job_, input, std::move(share[0]), threads_);
  const milliseconds wait(ranks_.size() > 1 ? 2 : 50);
  Record record;
  while (!workers.done() || from_others > 0) {
    if (stop && stop()) {
      workers.cancel();
      while (!workers.done()) {
        if (workers.pop(record, milliseconds(50))) take(record.tile, std::move(record.bytes));
      }
      return false;
    }
    if (workers.pop(record, workers.done() ? milliseconds(0) : wait))
      take(record.tile, std::move(record.bytes));
    bool any = false;
    while (from_others > 0 && take_message(take)) {
      --from_others;
      any = true;
    }
    if (!any && workers.done() && from_others > 0) std::this_thread::sleep_for(milliseconds(1));
  }
  return true;
}

void follow_tile_team(const std::function<TileInput()>& open, int threads, const MpiRanks& ranks) {
  TileInput about;
  std::unique_ptr<TileJob> job;
  RoundInput input;
  std::unique_ptr<Workers> workers;
  Bytes message;
  int from = 0;
  bool failed = false;
  for (;;) {
    bool idle = true;
    try {
      if (ranks.receive(message, from)) {
        idle = false;
        ByteReader reader(message);
        if (reader.get<Word>() == Word::kEnd) break;
        const auto grid = reader.get<TileGrid>();
        const auto tiles = reader.get_all<std::uint32_t>();
        workers.reset();
        read(reader, input);
        if (!about.source) about = open();
        job.reset(new TileJob{*about.source, about.detection, grid});
        workers = std::make_unique<Workers>(*job, input, tiles, threads);
      }
      Record record;
      if (workers && !failed && workers->pop(record, milliseconds(2))) {
        idle = false;
        ranks.send(0, record_message(record));
      }
    } catch (const std::exception& error) {
      failed = true;
      ranks.send(0, failure_message(error.what()));
    }
    if (idle) std::this_thread::sleep_for(milliseconds(1));
  }
  workers.reset();
  ranks.send(0, message_of(Word::kBye));
}

}  // namespace cairn::ground
