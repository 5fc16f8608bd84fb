//! Matches by the thousand: game simulator, rules and referee, GameController.
