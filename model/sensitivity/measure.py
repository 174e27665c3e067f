"""How the reaction of an image region to an edit is measured."""

from __future__ import annotations

from typing import Literal

Measure = Literal["change", "signed"]
"""Measure of a region's reaction to an edit of the opacity TF.

"signed" is the paper's (Eq. 11): the change of the l2 norm of the region's colours, above 0 where
they become brighter. It is 0 for a black region, and where some pixels become brighter as
much as others become darker. "change" is the l2 norm of the colours' change.
"""
