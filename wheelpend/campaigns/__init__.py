"""Campaigns: the same question to many logs, on all cores, and what the answers have in common.

one_log    one log's answer
study      all of them, each kept as it comes
summary    what they have in common: bias, spread and coverage of simulated ones, agreement of measured ones
"""

from wheelpend.campaigns.runner import Campaign, campaign

__all__ = ["Campaign", "campaign"]
