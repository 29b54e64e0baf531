"""Where does the model fail?"""

from allanite.criticism.verdict import Where, criticise

__all__ = ["Where", "criticise"]
