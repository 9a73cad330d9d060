"""A file that its writer has not ended, seen as if it had been.

HDF5 refuses to open such a file but for its SWMR readers, and these wait for sound tables with pauses that double a
hundred times: in a file whose writer is dead and whose tables are damaged, that is forever. What a SWMR reader sees is
what lies on the disk, since a SWMR writer writes nothing before what it points to. So the file is opened as a
finished one through a view in which only its first block differs: not marked as being written, and with the true
length. The file itself is never touched.
"""

import io
import os
import struct
from collections.abc import Buffer
from pathlib import Path
