from gnss_hil.tools.bench.errors import BenchError as BenchError
from gnss_hil.tools.bench.fixture import Bench as Bench
from gnss_hil.tools.bench.record import Run as Run
from gnss_hil.tools.bench.run import run as run
