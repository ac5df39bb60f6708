"""A plugin of pytest that hides DGL, as on Python 3.12 and newer: `-p tests.without_dgl`."""

import sys

sys.modules["dgl"] = None  # what is imported from now on finds none
