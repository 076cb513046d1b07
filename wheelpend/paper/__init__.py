"""The paper of Peng, Cheng and Tsai (Electronics 2023, 12, 4569): what it prints, and how that stands up."""
