-- wrk's side of bench/service.sh: POSTs a prepared body again and again, and writes down how long each request took.
--
--   BENCH_BODY    file with the body; one below 4096 bytes with a %06d or the like in it gets another number for each request
--   BENCH_TYPE    its Content-Type         BENCH_ACCEPT  the format asked for
--   BENCH_OUT     file name's beginning; thread N writes BENCH_OUT.N: request id, milliseconds; and the status with BENCH_ANSWERS
--   BENCH_ANSWERS set: look at the answers. "wait": a 503 is followed by the pause that its Retry-After asks for
--
-- A thread has one connection (wrk -t N -c N), so its requests come one after the other. A request's time runs from its last byte made
-- to the moment wrk asks for the next one, when the answer is read whole, the connection closed and another one open: what a client waits
-- for, connecting included. With BENCH_ANSWERS it ends with the answer; but then wrk collects the answer piecemeal for Lua, which costs it
-- a millisecond a megabyte.
local ffi = require("ffi")
ffi.cdef [[ typedef struct { long s, ns; } bench_time; int clock_gettime(int clock, bench_time *time); ]]
local time = ffi.new("bench_time")
local monotonic = 1

local function now_ms()
   ffi.C.clock_gettime(monotonic, time)
   return tonumber(time.s) * 1e3 + tonumber(time.ns) * 1e-6
end

local threads = 0
function setup(thread)
   thread:set("number", threads)
   threads = threads + 1
end

local answers = os.getenv("BENCH_ANSWERS")
local head = { ["Content-Type"] = os.getenv("BENCH_TYPE"), ["Accept"] = os.getenv("BENCH_ACCEPT") }
local body, patched, out, started, refused
local count = 0

function init()
   local file = assert(io.open(os.getenv("BENCH_BODY"), "rb"))
   body = file:read("*a")
   file:close()
   patched = #body < 4096 and body:find("%", 1, true) ~= nil
   out = assert(io.open(os.getenv("BENCH_OUT") .. "." .. number, "w"))
   out:setvbuf("line")
end

local function id() return "bench-" .. number .. "-" .. count end

function request()
   local now = now_ms()
   if started and not answers then out:write(string.format("%s %.4f\n", id(), now - started)) end
   count = count + 1
   head["X-Request-Id"] = id()
   local text = wrk.format("POST", wrk.path, head, patched and body:format(number * 100000 + count) or body)
   started = now_ms()
   return text
end

if answers then
   function response(status)
      out:write(string.format("%s %.4f %d\n", id(), now_ms() - started, status))
      refused = status == 503
   end
end

if answers == "wait" then
   function delay() return refused and 1000 or 0 end
end
