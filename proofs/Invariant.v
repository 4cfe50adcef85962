(** An inductive invariant implies the formula: the checker and its soundness.

    A flight's time is cut into spans.  A system has states; in each span it makes some
    of the moves, with or without a letter, and goes on to the next span, where it may
    have to be read.  A word that breaks the formula satisfies its negation, by one
    alternative after another.  An invariant lists, for each span, configurations: a
    state and one alternative.  It holds all in which the system may be, and none in
    which a word may end that satisfies the negation. *)

Require Import List Bool Arith Lia.
From LtlPlan Require Import Progression.
Import ListNotations.

Section System.
  Variables (S Span : Type).
  Variable moves : Span -> S -> list (option letter * S).
  Variable enters : Span -> S -> list (option letter * S).
  Variable final : S -> bool.

  Definition read (o : option letter) (w : word) : word :=
    match o with Some a => a :: w | None => w end.

  (** The words of the system from a state in the first of the spans. *)
  Inductive run : list Span -> S -> word -> Prop :=
    | run_end : forall p s, final s = true -> run [p] s []
    | run_move : forall p ps s o t w,
        In (o, t) (moves p s) -> run (p :: ps) t w -> run (p :: ps) s (read o w)
    | run_span : forall p q ps s o t w,
        In (o, t) (enters q s) -> run (q :: ps) t w -> run (p :: q :: ps) s (read o w).

  (** [below t s]: state t may do all that s may do. *)
  Variable below : S -> S -> bool.
  Hypothesis below_trans : forall a b c, below a b = true -> below b c = true -> below a c = true.
  Hypothesis below_moves : forall t s p o s', below t s = true -> In (o, s') (moves p s) ->
    exists t', In (o, t') (moves p t) /\ below t' s' = true.
  Hypothesis below_enters : forall t s p o s', below t s = true -> In (o, s') (enters p s) ->
    exists t', In (o, t') (enters p t) /\ below t' s' = true.
  Hypothesis below_final : forall t s, below t s = true -> final s = true -> final t = true.

  (** *** The algorithm *)

  Definition configuration : Type := S * alternative.

  Definition covered (i : list configuration) (s : S) (c : alternative) : bool :=
    existsb (fun e => below (fst e) s && includes c (snd e)) i.

  Definition after (o : option letter) (c : alternative) : state :=
    match o with Some a => progress_all a c | None => [c] end.

  Definition all_covered (i : list configuration) (c : alternative)
      (ms : list (option letter * S)) : bool :=
    forallb (fun m => forallb (covered i (snd m)) (after (fst m) c)) ms.

  Definition closed (p : Span) (i : list configuration) : bool :=
    forallb (fun e => all_covered i (snd e) (moves p (fst e))) i.

  Definition handed (q : Span) (i j : list configuration) : bool :=
    forallb (fun e => all_covered j (snd e) (enters q (fst e))) i.

  (** What the empty word satisfies. *)
  Fixpoint satisfied_empty (f : formula) : bool :=
    match f with
    | Lit _ _ | Until _ _ => false
    | Const b => b
    | And g h => satisfied_empty g && satisfied_empty h
    | Or g h => satisfied_empty g || satisfied_empty h
    | Release _ _ => true
    end.
  Definition over (c : alternative) : bool := forallb satisfied_empty c.

  Definition refuted (i : list configuration) : bool :=
    forallb (fun e => negb (final (fst e) && over (snd e))) i.

  Fixpoint chain (ps : list Span) (is : list (list configuration)) : bool :=
    match ps, is with
    | [p], [i] => closed p i && refuted i
    | p :: (q :: _) as qs, i :: (j :: _) as js => closed p i && handed q i j && chain qs js
    | _, _ => false
    end.

  (** [f] is the formula's negation. *)
  Definition check_invariant (f : formula) (starts : list (option letter * S))
      (ps : list Span) (is : list (list configuration)) : bool :=
    match is with
    | i :: _ => all_covered i [f] starts && chain ps is
    | [] => false
    end.

  (** *** Its soundness *)

  Definition keeps (c : alternative) (w : word) : Prop := forall f, In f c -> sat f w.

  Lemma after_keeps : forall o c w, keeps c (read o w) -> owes (after o c) w.
  Proof.
    intros [a|] c w H; cbn in *; [apply progress_all_sat; auto|].
    exists c; split; [left|]; auto.
  Qed.

  Lemma satisfied_empty_complete : forall f, sat f [] -> satisfied_empty f = true.
  Proof.
    induction f; cbn; intros H; auto; try tauto.
    - apply andb_true_iff; tauto.
    - apply orb_true_iff; tauto.
    - apply until_nil in H; tauto.
  Qed.

  Lemma over_empty : forall c, keeps c [] -> over c = true.
  Proof.
    intros c K; apply forallb_forall; intros f Hf; apply satisfied_empty_complete, K, Hf.
  Qed.

  Lemma all_covered_next : forall i c ms o t s w, all_covered i c ms = true ->
    In (o, t) ms -> below t s = true -> keeps c (read o w) ->
    exists t' c', In (t', c') i /\ below t' s = true /\ keeps c' w.
  Proof.
    intros i c ms o t s w A I B K; unfold all_covered in A; rewrite forallb_forall in A.
    specialize (A _ I); cbn in A; rewrite forallb_forall in A.
    destruct (after_keeps _ _ _ K) as (d & Hd & D); specialize (A d Hd).
    unfold covered in A; apply existsb_exists in A as ([t' c'] & Ie & C); cbn in C.
    apply andb_prop in C as [C1 C2]; exists t', c'; repeat split; eauto.
    intros f Hf; apply (includes_sound d c'); auto.
  Qed.

  Lemma chain_head : forall p ps i is, chain (p :: ps) (i :: is) = true -> closed p i = true.
  Proof.
    intros p ps i is H; destruct ps as [|q ps], is as [|j is]; try discriminate; cbn in H.
    - apply andb_prop in H; tauto.
    - repeat (apply andb_prop in H as [H ?]); auto.
  Qed.

  Lemma chain_sound : forall ps s w, run ps s w -> forall i is t c,
    chain ps (i :: is) = true -> In (t, c) i -> below t s = true -> ~ keeps c w.
  Proof.
    induction 1 as [p s F | p ps s o s' w M R IH | p q ps s o s' w E R IH]; intros i is t c C I B K.
    - destruct is; [|discriminate]; cbn in C; apply andb_prop in C as [_ A].
      unfold refuted in A; rewrite forallb_forall in A; specialize (A _ I); cbn [fst snd] in A.
      rewrite (below_final t s B F), (over_empty c K) in A; discriminate.
    - pose proof (chain_head _ _ _ _ C) as L; unfold closed in L.
      rewrite forallb_forall in L; specialize (L _ I); cbn in L.
      destruct (below_moves t s p o s' B M) as (t' & M' & B').
      destruct (all_covered_next i c _ o t' s' w L M' B' K) as (t2 & c2 & I2 & B2 & K2).
      apply (IH i is t2 c2); auto.
    - destruct is as [|j is]; [discriminate|].
      change (closed p i && handed q i j && chain (q :: ps) (j :: is) = true) in C.
      apply andb_prop in C as [L C]; apply andb_prop in L as [_ L].
      unfold handed in L; rewrite forallb_forall in L; specialize (L _ I); cbn in L.
      destruct (below_enters t s q o s' B E) as (t' & E' & B').
      destruct (all_covered_next j c _ o t' s' w L E' B' K) as (t2 & c2 & I2 & B2 & K2).
      apply (IH j is t2 c2); auto.
  Qed.

  Hypothesis below_refl : forall s, below s s = true.

  Theorem check_invariant_sound : forall f starts ps is o s w,
    check_invariant f starts ps is = true -> In (o, s) starts -> run ps s w ->
    ~ sat f (read o w).
  Proof.
    intros f starts ps [|i is] o s w H I R K; [discriminate|]; cbn in H.
    apply andb_prop in H as [A C].
    assert (K' : keeps [f] (read o w)) by (intros g [<-|[]]; auto).
    destruct (all_covered_next i [f] starts o s s w A I (below_refl s) K') as (t & c & It & B & Kc).
    apply (chain_sound ps s w R i is t c C It B Kc).
  Qed.
End System.

(** The negation's normal form is satisfied by no word: the formula by each. *)
Lemma negation_refuted : forall f w, w <> [] -> ~ sat (normal false f) w -> ssat f w.
Proof.
  intros f w H N; destruct (ssat_decided f w) as [|D]; auto.
  exfalso; apply N, (normal_meaning f false w H), D.
Qed.

(** ** Courses: what a flight does, event by event, span by span *)

Section Course.
  Variables (X E Span : Type).
  Variable may_be : Span -> X -> Prop.
  Variable does : Span -> X -> E -> X -> Prop.
  Variable ends : X -> Prop.

  Inductive course : list Span -> X -> list E -> Prop :=
    | course_end : forall p x, ends x -> course [p] x []
    | course_event : forall p ps x e y es, does p x e y ->
        course (p :: ps) y es -> course (p :: ps) x (e :: es)
    | course_span : forall p q ps x es, may_be q x ->
        course (q :: ps) x es -> course (p :: q :: ps) x es.
End Course.

(** ** Teams

    Each robot has places in an order of its own: what it shows, and from which to which
    it may change.  A span says where each robot may be in it.  The robots of a proof are
    those that it follows; of all others it knows what they may show in a span. *)

Record robot := Robot { shown : list letter; changes : list (nat * nat) }.
Definition places : Type := list nat.

Definition letter_at (r : robot) (q : nat) : letter := nth q (shown r) [].
Definition member (q : nat) (l : list nat) : bool := existsb (Nat.eqb q) l.

Fixpoint permitted (p : list (list nat)) (c : places) : bool :=
  match p, c with
  | [], [] => true
  | l :: p', q :: c' => member q l && permitted p' c'
  | _, _ => false
  end.

(** Any subset of the robots may change at one instant. *)
Inductive changed : list robot -> places -> places -> Prop :=
  | changed_none : changed [] [] []
  | changed_robot : forall r rs q q' c c',
      q' = q \/ In (q, q') (changes r) -> changed rs c c' ->
      changed (r :: rs) (q :: c) (q' :: c').

Definition targets (r : robot) (q : nat) : list nat :=
  map snd (filter (fun e => fst e =? q) (changes r)).

Fixpoint product {A} (ls : list (list A)) : list (list A) :=
  match ls with
  | [] => [[]]
  | l :: r => flat_map (fun x => map (cons x) (product r)) l
  end.

Lemma targets_in : forall r q q', In (q, q') (changes r) -> In q' (targets r q).
Proof.
  intros r q q' H; unfold targets; apply in_map_iff; exists (q, q'); split; auto.
  apply filter_In; split; auto; apply Nat.eqb_refl.
Qed.

Lemma product_in : forall A (x : A) l xs ls,
  In x l -> In xs (product ls) -> In (x :: xs) (product (l :: ls)).
Proof. intros; simpl; apply in_flat_map; exists x; split; auto; apply in_map; auto. Qed.

Fixpoint equal_places (c d : places) : bool :=
  match c, d with
  | [], [] => true
  | q :: c', r :: d' => (q =? r) && equal_places c' d'
  | _, _ => false
  end.

Lemma equal_places_eq : forall c d, equal_places c d = true <-> c = d.
Proof.
  induction c as [|q c IH]; intros [|r d]; split; intros H; try discriminate; auto; cbn in *.
  - apply andb_prop in H as [E H]; f_equal; [apply Nat.eqb_eq | apply IH]; auto.
  - injection H as <- <-; rewrite Nat.eqb_refl; apply IH; auto.
Qed.

Section Joint.
  Variable robots : list robot.
  (** Where the robots may be at the end. *)
  Variable last : places -> bool.

  (** A span: where the robots may be, and what the team may show while they are there. *)
  Definition joint_span : Type := list (list nat) * (places -> list letter).

  (** What a team does: its robots' places and its letter, one instant after another. *)
  Definition joint_may_be (p : joint_span) (x : places * letter) : Prop :=
    permitted (fst p) (fst x) = true /\ In (snd x) (snd p (fst x)).
  Definition joint_does (p : joint_span) (x y z : places * letter) : Prop :=
    z = y /\ changed robots (fst x) (fst y) /\ joint_may_be p y.
  Definition joint_course := course _ _ _ joint_may_be joint_does (fun x => last (fst x) = true).

  Fixpoint joint_choices (rs : list robot) (c : places) : list (list nat) :=
    match rs, c with
    | r :: rs', q :: c' => (q :: targets r q) :: joint_choices rs' c'
    | _, _ => []
    end.

  Definition shows_there (p : joint_span) (c : places) : list (option letter * places) :=
    if permitted (fst p) c then map (fun a => (Some a, c)) (snd p c) else [].

  Definition joint_moves (p : joint_span) (c : places) : list (option letter * places) :=
    flat_map (shows_there p) (product (joint_choices robots c)).

  Definition check_joint (f : spec) (starts : list (letter * places)) (ps : list joint_span)
      (is : list (list (configuration places))) : bool :=
    check_invariant _ _ joint_moves shows_there last equal_places
      (normal false f) (map (fun m => (Some (fst m), snd m)) starts) ps is.

  (** *** Its soundness *)

  Lemma changed_choices : forall rs c c', changed rs c c' ->
    In c' (product (joint_choices rs c)).
  Proof.
    induction 1 as [|r rs q q' c c' H K IH]; [left; auto|].
    cbn [joint_choices]; apply product_in; auto.
    destruct H as [->|H]; [left | right; apply targets_in]; auto.
  Qed.

  Lemma may_be_shows : forall p c a, joint_may_be p (c, a) -> In (Some a, c) (shows_there p c).
  Proof.
    intros p c a [P A]; unfold shows_there; cbn in *; rewrite P; apply in_map_iff; eauto.
  Qed.

  (** At each hand-over the letter that is held is read again: that changes no formula. *)
  Lemma joint_run : forall ps x xs, joint_course ps x xs ->
    exists w, run _ _ joint_moves shows_there last ps (fst x) w
      /\ alike (snd x :: w) (snd x :: map snd xs).
  Proof.
    induction 1 as [p x L | p ps [c a] y z xs (-> & K & M) C (w & R & A)
      | p q ps [c a] xs M C (w & R & A)]; cbn [fst snd map] in *.
    - exists []; split; [apply run_end; exact L | intros f; tauto].
    - destruct y as [c' a']; exists (a' :: w); split; [|apply alike_cons; auto].
      apply (run_move _ _ joint_moves shows_there last p ps c (Some a') c'); auto.
      unfold joint_moves; apply in_flat_map; exists c'; split;
        [apply changed_choices | apply may_be_shows]; auto.
    - exists (a :: w); split.
      + apply (run_span _ _ joint_moves shows_there last p q ps c (Some a) c); auto.
        apply may_be_shows; auto.
      + intros f; rewrite (stutter a w f); apply A.
  Qed.

  Theorem check_joint_sound : forall f starts ps is c a xs,
    check_joint f starts ps is = true -> In (a, c) starts -> joint_course ps (c, a) xs ->
    ssat f (a :: map snd xs).
  Proof.
    intros f starts ps is c a xs H I C; destruct (joint_run _ _ _ C) as (w & R & A).
    apply negation_refuted; [discriminate|]; rewrite <- (A (normal false f)).
    refine (check_invariant_sound _ _ joint_moves shows_there last equal_places
      _ _ _ _ _ (normal false f) _ ps is (Some a) c w H _ R).
    - intros x y z; rewrite !equal_places_eq; congruence.
    - intros t s p o s' E M; apply equal_places_eq in E as ->; exists s'.
      rewrite equal_places_eq; auto.
    - intros t s p o s' E M; apply equal_places_eq in E as ->; exists s'.
      rewrite equal_places_eq; auto.
    - intros t s E; apply equal_places_eq in E as ->; auto.
    - intros s; apply equal_places_eq; auto.
    - apply in_map_iff; exists (a, c); auto.
  Qed.
End Joint.

Section Own.
  (** A position of the word is one robot's letter; each robot is read at least once in
      each of its letters, and a letter that is held may be read again. *)
  Variable robots : list robot.
  (** Where the robots may be at the end. *)
  Variable last : places -> bool.

  (** A span: where the robots may be, and what the others may show. *)
  Definition own_span : Type := list (list nat) * list letter.

  Inductive event := Read (i : nat) | ReadOther (a : letter) | Change (c : places).

  Definition own_letter (i : nat) (c : places) : letter :=
    letter_at (nth i robots (Robot [] [])) (nth i c 0).

  (** A flight with its readings. *)
  Definition own_may_be (p : own_span) (c : places) : Prop := permitted (fst p) c = true.
  Definition own_does (p : own_span) (c : places) (e : event) (c' : places) : Prop :=
    match e with
    | Read i => c' = c /\ i < length robots
    | ReadOther a => c' = c /\ In a (snd p)
    | Change d => c' = d /\ changed robots c d /\ own_may_be p d
    end.
  Definition own_course := course _ _ _ own_may_be own_does (fun c => last c = true).

  Fixpoint own_word (c : places) (es : list event) : word :=
    match es with
    | [] => []
    | Read i :: r => own_letter i c :: own_word c r
    | ReadOther a :: r => a :: own_word c r
    | Change c' :: r => own_word c' r
    end.

  (** Letters are the same where they hold the same propositions. *)
  Definition same_letter (a b : letter) : bool :=
    forallb (fun p => member p b) a && forallb (fun p => member p a) b.

  (** Robot [i] is read in each of its letters; [b]: it was read in the present one. *)
  Fixpoint read_in_each (i : nat) (b : bool) (c : places) (es : list event) : Prop :=
    match es with
    | [] => b = true
    | Read j :: r => read_in_each i (b || (i =? j)) c r
    | ReadOther _ :: r => read_in_each i b c r
    | Change c' :: r =>
        if same_letter (own_letter i c) (own_letter i c') then read_in_each i b c' r
        else b = true /\ read_in_each i false c' r
    end.

  (** *** The system: places, and who was read since its letter changed *)

  Definition marked : Type := list (nat * bool).

  (** The same places, and read at least where the other one is. *)
  Fixpoint read_more (c d : marked) : bool :=
    match c, d with
    | [], [] => true
    | (q, b) :: c', (r, e) :: d' => (q =? r) && implb e b && read_more c' d'
    | _, _ => false
    end.

  Definition moved (r : robot) (q : nat) (b : bool) (q' : nat) : list (nat * bool) :=
    if same_letter (letter_at r q) (letter_at r q') then [(q', b)]
    else if b then [(q', false)] else [].

  (** One robot changes, in silence. *)
  Fixpoint singles (rs : list robot) (p : list (list nat)) (s : marked) : list marked :=
    match rs, p, s with
    | r :: rs', l :: p', (q, b) :: s' =>
        map (fun x => x :: s')
          (flat_map (moved r q b) (filter (fun q' => member q' l) (targets r q)))
        ++ map (cons (q, b)) (singles rs' p' s')
    | _, _, _ => []
    end.

  Fixpoint mark (i : nat) (s : marked) : marked :=
    match s, i with
    | [], _ => []
    | (q, _) :: r, O => (q, true) :: r
    | x :: r, S j => x :: mark j r
    end.

  Definition silent (s : marked) : option letter * marked := (None, s).

  Definition own_moves (p : own_span) (s : marked) : list (option letter * marked) :=
    map (fun i => (Some (own_letter i (map fst s)), mark i s)) (seq 0 (length robots))
    ++ map (fun a => (Some a, s)) (snd p)
    ++ map silent (singles robots (fst p) s).

  Definition own_enters (p : own_span) (s : marked) : list (option letter * marked) :=
    if permitted (fst p) (map fst s) then [silent s] else [].
  Definition own_final (s : marked) : bool := last (map fst s) && forallb snd s.
  Definition unread (c : places) : marked := map (fun q => (q, false)) c.

  Definition check_own (f : spec) (starts : list places) (ps : list own_span)
      (is : list (list (configuration marked))) : bool :=
    check_invariant _ _ own_moves own_enters own_final read_more
      (normal false f) (map (fun c => silent (unread c)) starts) ps is.

  (** *** Who was read more may do more *)

  Lemma read_more_refl : forall s, read_more s s = true.
  Proof.
    induction s as [|[q b] s IH]; auto; cbn; rewrite Nat.eqb_refl, IH; destruct b; auto.
  Qed.

  Lemma read_more_trans : forall a b c,
    read_more a b = true -> read_more b c = true -> read_more a c = true.
  Proof.
    induction a as [|[q x] a IH]; intros [|[r y] b] [|[t z] c] H K; try discriminate; auto.
    cbn in *; apply andb_prop in H as [H1 H2]; apply andb_prop in H1 as [H0 H1].
    apply andb_prop in K as [K1 K2]; apply andb_prop in K1 as [K0 K1].
    apply Nat.eqb_eq in H0, K0; subst; rewrite Nat.eqb_refl, (IH b c) by auto.
    destruct x, y, z; auto.
  Qed.

  Lemma read_more_places : forall t s, read_more t s = true -> map fst t = map fst s.
  Proof.
    induction t as [|[q b] t IH]; intros [|[r e] s] H; try discriminate; auto; cbn in *.
    apply andb_prop in H as [H K]; apply andb_prop in H as [E _]; apply Nat.eqb_eq in E.
    f_equal; auto.
  Qed.

  Lemma read_more_final : forall t s, read_more t s = true -> own_final s = true ->
    own_final t = true.
  Proof.
    intros t s H F; unfold own_final in *; rewrite (read_more_places t s H).
    apply andb_prop in F as [L F]; apply andb_true_iff; split; auto.
    clear L; revert s H F; induction t as [|[q b] t IH]; intros [|[r e] s] H F; try discriminate;
      auto; cbn in *.
    apply andb_prop in H as [H K]; apply andb_prop in H as [_ E]; apply andb_prop in F as [Fe F].
    apply andb_true_iff; split; [destruct b, e; auto | apply (IH s); auto].
  Qed.

  Lemma read_more_mark : forall t s i, read_more t s = true -> read_more (mark i t) (mark i s) = true.
  Proof.
    induction t as [|[q b] t IH]; intros [|[r e] s] i H; try discriminate; destruct i; auto;
      cbn in *; apply andb_prop in H as [H K]; apply andb_prop in H as [E B].
    - rewrite E, K; auto.
    - rewrite E, B; apply IH; auto.
  Qed.

  Lemma read_more_single : forall rs p t s s', read_more t s = true -> In s' (singles rs p s) ->
    exists t', In t' (singles rs p t) /\ read_more t' s' = true.
  Proof.
    induction rs as [|r rs IH]; intros [|l p] [|[q b] t] [|[q0 e] s] s' H I; try discriminate;
      try destruct I.
    cbn in H; apply andb_prop in H as [H K]; apply andb_prop in H as [E B].
    apply Nat.eqb_eq in E; subst q0; cbn [singles] in *; apply in_app_or in I as [I|I].
    - apply in_map_iff in I as ([q' x] & <- & I); apply in_flat_map in I as (q2 & F & I).
      assert (M : exists y, In (q', y) (moved r q b q2) /\ implb x y = true).
      { unfold moved in *; destruct (same_letter _ _).
        - destruct I as [I|[]]; injection I as -> ->; exists b; split; [left|]; auto.
        - destruct e; [|destruct I]; destruct b; [|discriminate].
          destruct I as [I|[]]; injection I as -> <-; exists false; split; [left|]; auto. }
      destruct M as (y & My & Y); exists ((q', y) :: t); split.
      + apply in_or_app; left; apply in_map_iff; exists (q', y); split; auto.
        apply in_flat_map; eauto.
      + cbn; rewrite Nat.eqb_refl, Y, K; auto.
    - apply in_map_iff in I as (s2 & <- & I); destruct (IH p t s s2 K I) as (t2 & I2 & K2).
      exists ((q, b) :: t2); split.
      + apply in_or_app; right; apply in_map; auto.
      + cbn; rewrite Nat.eqb_refl, B, K2; auto.
  Qed.

  Lemma read_more_moves : forall t s p o s', read_more t s = true -> In (o, s') (own_moves p s) ->
    exists t', In (o, t') (own_moves p t) /\ read_more t' s' = true.
  Proof.
    intros t s p o s' H I; unfold own_moves in I |- *; rewrite (read_more_places t s H).
    apply in_app_or in I as [I|I]; [|apply in_app_or in I as [I|I]].
    - apply in_map_iff in I as (i & E & I); injection E as <- <-; exists (mark i t); split.
      + apply in_or_app; left; apply in_map_iff; eauto.
      + apply read_more_mark; auto.
    - apply in_map_iff in I as (a & E & I); injection E as <- <-; exists t; split; auto.
      apply in_or_app; right; apply in_or_app; left; apply in_map_iff; eauto.
    - apply in_map_iff in I as (s2 & E & I); injection E as <- <-.
      destruct (read_more_single _ _ _ _ _ H I) as (t2 & I2 & K2); exists t2; split; auto.
      apply in_or_app; right; apply in_or_app; right; apply in_map_iff; exists t2; auto.
  Qed.

  Lemma read_more_enters : forall t s p o s', read_more t s = true -> In (o, s') (own_enters p s) ->
    exists t', In (o, t') (own_enters p t) /\ read_more t' s' = true.
  Proof.
    intros t s p o s' H I; unfold own_enters in *; rewrite (read_more_places t s H).
    destruct (permitted _ _); [|destruct I].
    destruct I as [I|[]]; injection I as <- <-; exists t; split; [left|]; auto.
  Qed.

  (** *** A flight is a run: changes at one instant are changes one after another *)

  Fixpoint read_after (rs : list robot) (s : marked) (c' : places) : marked :=
    match rs, s, c' with
    | r :: rs', (q, b) :: s', q' :: c'' =>
        (q', if same_letter (letter_at r q) (letter_at r q') then b else false)
          :: read_after rs' s' c''
    | _, _, _ => []
    end.

  (** May all robots go on?  Robot by robot, as [read_in_each] asks. *)
  Fixpoint may_change (rs : list robot) (s : marked) (c' : places) : Prop :=
    match rs, s, c' with
    | r :: rs', (q, b) :: s', q' :: c'' =>
        (same_letter (letter_at r q) (letter_at r q') = true \/ b = true)
          /\ may_change rs' s' c''
    | _, _, _ => True
    end.

  Lemma same_letter_refl : forall a, same_letter a a = true.
  Proof.
    intros a; unfold same_letter; apply andb_true_iff; split; apply forallb_forall; intros p H;
      unfold member; apply existsb_exists; exists p; split; auto using Nat.eqb_refl.
  Qed.

  Inductive silently (rs : list robot) (p : list (list nat)) : marked -> marked -> Prop :=
    | silently_none : forall s, silently rs p s s
    | silently_one : forall s t u, In t (singles rs p s) -> silently rs p t u -> silently rs p s u.

  Lemma silently_behind : forall rs p s t r l x, silently rs p s t ->
    silently (r :: rs) (l :: p) (x :: s) (x :: t).
  Proof.
    intros rs p s t r l [q b] H; induction H as [s | s t u I H IH]; [constructor|].
    apply silently_one with ((q, b) :: t); auto; cbn [singles].
    apply in_or_app; right; apply in_map; auto.
  Qed.

  Lemma changed_silently : forall rs c c', changed rs c c' -> forall p s, map fst s = c ->
    permitted p c' = true -> may_change rs s c' -> silently rs p s (read_after rs s c').
  Proof.
    induction 1 as [|r rs q q' c c' H K IH]; intros [|l p] [|[q0 b] s] E P M; try discriminate.
    - constructor.
    - injection E as -> E; cbn in P; apply andb_prop in P as [Pq P]; destruct M as [M1 M2].
      cbn [read_after].
      assert (T : silently (r :: rs) (l :: p)
        ((q', if same_letter (letter_at r q) (letter_at r q') then b else false) :: s)
        ((q', if same_letter (letter_at r q) (letter_at r q') then b else false)
          :: read_after rs s c')) by (apply silently_behind, IH; auto).
      destruct H as [->|H]; [rewrite same_letter_refl in *; exact T|].
      refine (silently_one _ _ _ _ _ _ T); cbn [singles]; apply in_or_app; left.
      apply in_map_iff; eexists; split; [reflexivity|]; apply in_flat_map; exists q'; split.
      + apply filter_In; split; auto; apply targets_in; auto.
      + unfold moved; destruct (same_letter _ _); [left; auto|].
        destruct M1 as [M1 | ->]; [discriminate | left; auto].
  Qed.

  Lemma run_silently : forall p ps s t w, silently robots (fst p) s t ->
    run _ _ own_moves own_enters own_final (p :: ps) t w ->
    run _ _ own_moves own_enters own_final (p :: ps) s w.
  Proof.
    induction 1 as [s | s t u I H IH]; intros R; auto.
    apply (run_move _ _ own_moves own_enters own_final p ps s None t); auto.
    unfold own_moves; apply in_or_app; right; apply in_or_app; right; apply in_map_iff; eauto.
  Qed.

  Lemma read_after_places : forall rs c c', changed rs c c' ->
    forall s, map fst s = c -> map fst (read_after rs s c') = c'.
  Proof.
    induction 1 as [|r rs q q' c c' H K IH]; intros [|[q0 b] s] E; try discriminate; auto.
    injection E as <- E; cbn; f_equal; auto.
  Qed.

  Lemma read_after_nth : forall rs c c', changed rs c c' ->
    forall s i, map fst s = c -> i < length rs ->
    let a := letter_at (nth i rs (Robot [] [])) in
    snd (nth i (read_after rs s c') (0, false)) =
    (if same_letter (a (nth i c 0)) (a (nth i c' 0)) then snd (nth i s (0, false)) else false).
  Proof.
    induction 1 as [|r rs q q' c c' H K IH]; intros [|[q0 b] s] i E L; cbn in L; try lia;
      try discriminate.
    injection E as <- E; destruct i as [|i]; cbn; [destruct (same_letter _ _); auto|].
    apply IH; auto; lia.
  Qed.

  Lemma may_change_all : forall rs c c', changed rs c c' -> forall s, map fst s = c ->
    (forall i, i < length rs ->
      let a := letter_at (nth i rs (Robot [] [])) in
      same_letter (a (nth i c 0)) (a (nth i c' 0)) = true \/ snd (nth i s (0, false)) = true) ->
    may_change rs s c'.
  Proof.
    induction 1 as [|r rs q q' c c' H K IH]; intros [|[q0 b] s] E A; try discriminate; cbn; auto.
    injection E as <- E; split; [apply (A 0); cbn; lia|].
    apply IH; auto; intros i L; apply (A (S i)); cbn; lia.
  Qed.

  Lemma mark_places : forall s i, map fst (mark i s) = map fst s.
  Proof. induction s as [|[q b] s IH]; intros [|i]; cbn; auto; f_equal; auto. Qed.

  Lemma mark_nth : forall s i j, j < length s ->
    snd (nth j (mark i s) (0, false)) = snd (nth j s (0, false)) || (j =? i).
  Proof.
    induction s as [|[q b] s IH]; intros i j L; cbn in L; [lia|].
    destruct i as [|i], j as [|j]; cbn; rewrite ?orb_true_r, ?orb_false_r; auto.
    apply IH; lia.
  Qed.

  Lemma changed_length : forall rs c c', changed rs c c' ->
    length c = length rs /\ length c' = length rs.
  Proof. induction 1; cbn; lia. Qed.

  Lemma own_run : forall ps c es, own_course ps c es ->
    forall s, map fst s = c -> length s = length robots ->
    (forall i, i < length robots -> read_in_each i (snd (nth i s (0, false))) c es) ->
    run _ _ own_moves own_enters own_final ps s (own_word c es).
  Proof.
    induction 1 as [p c Z | p ps c e c' es D C IH | p q ps c es P C IH]; intros s E N A.
    - apply run_end; unfold own_final; rewrite E, Z; apply forallb_forall; intros x I.
      apply (In_nth _ _ (0, false)) in I as (i & L & <-); apply A; lia.
    - destruct e as [i | a | d]; cbn in D; [destruct D as [-> L] | destruct D as [-> L] |
        destruct D as (-> & H & P)]; cbn [own_word].
      + apply (run_move _ _ own_moves own_enters own_final p ps s (Some (own_letter i c)) (mark i s)).
        * unfold own_moves; apply in_or_app; left; apply in_map_iff; exists i.
          rewrite E; split; auto; apply in_seq; lia.
        * apply IH; [rewrite mark_places; auto | |].
          -- rewrite <- (map_length fst), mark_places, map_length; auto.
          -- intros j Lj; rewrite mark_nth by lia; apply (A j Lj).
      + apply (run_move _ _ own_moves own_enters own_final p ps s (Some a) s); [|apply IH; auto].
        unfold own_moves; apply in_or_app; right; apply in_or_app; left; apply in_map_iff; eauto.
      + pose proof (changed_length _ _ _ H) as [Lc Lc'].
        apply run_silently with (read_after robots s d).
        * apply (changed_silently _ c); auto.
          apply (may_change_all _ _ _ H); auto; intros i L a; specialize (A i L); cbn in A.
          unfold own_letter in A; fold a in A.
          destruct (same_letter _ _); [auto | right; tauto].
        * apply IH.
          -- apply (read_after_places _ _ _ H); auto.
          -- rewrite <- (map_length fst), (read_after_places _ _ _ H); auto.
          -- intros i L; rewrite (read_after_nth _ _ _ H) by auto; specialize (A i L); cbn in A.
             unfold own_letter in A; destruct (same_letter _ _); [auto | tauto].
    - apply (run_span _ _ own_moves own_enters own_final p q ps s None s); [|apply IH; auto].
      unfold own_enters; rewrite E, P; left; auto.
  Qed.

  Theorem check_own_sound : forall f starts ps is c es,
    check_own f starts ps is = true -> In c starts -> own_course ps c es ->
    length c = length robots -> own_word c es <> [] ->
    (forall i, i < length robots -> read_in_each i false c es) ->
    ssat f (own_word c es).
  Proof.
    intros f starts ps is c es H I K L NE A; apply negation_refuted; auto.
    assert (E : forall d, map fst (unread d) = d)
      by (induction d as [|q d IH]; cbn; f_equal; auto).
    assert (R : run _ _ own_moves own_enters own_final ps (unread c) (own_word c es)).
    { apply own_run; auto; [unfold unread; rewrite map_length; auto|].
      intros i Li; replace (snd (nth i (unread c) (0, false))) with false; [apply A; auto|].
      unfold unread; change (0, false) with ((fun q => (q, false)) 0); now rewrite map_nth. }
    refine (check_invariant_sound _ _ own_moves own_enters own_final read_more
      read_more_trans read_more_moves read_more_enters read_more_final read_more_refl
      (normal false f) _ ps is None (unread c) _ H _ R).
    apply in_map_iff; exists c; auto.
  Qed.
End Own.

(** Letters that are cut to fewer propositions are fewer: a robot that is read in each of
    its letters is read in each of its cut letters. *)
Section Cut.
  Variables (robots : list robot) (cut : letter -> letter).
  Hypothesis cut_same : forall a b, same_letter a b = true -> same_letter (cut a) (cut b) = true.

  Definition cut_robot (r : robot) : robot := Robot (map cut (shown r)) (changes r).
  Hypothesis cut_empty : cut [] = [].

  Lemma cut_letter : forall i c, own_letter (map cut_robot robots) i c = cut (own_letter robots i c).
  Proof.
    intros i c; unfold own_letter, letter_at.
    assert (E : Robot [] [] = cut_robot (Robot [] [])) by reflexivity.
    rewrite E at 1; rewrite map_nth; cbn [cut_robot shown].
    rewrite <- cut_empty at 1; apply map_nth.
  Qed.

  Lemma read_in_each_more : forall rs es i c, read_in_each rs i false c es ->
    read_in_each rs i true c es.
  Proof.
    intros rs es; induction es as [|[j | a | c'] es IH]; intros i c H; cbn in *; auto.
    - destruct (i =? j); auto.
    - destruct (same_letter _ _); auto. destruct H; discriminate.
  Qed.

  Theorem read_in_each_cut : forall es i b c, read_in_each robots i b c es ->
    read_in_each (map cut_robot robots) i b c es.
  Proof.
    induction es as [|[j | a | c'] es IH]; intros i b c H; cbn in *; auto.
    rewrite !cut_letter.
    destruct (same_letter (own_letter robots i c) (own_letter robots i c')) eqn:S.
    - rewrite cut_same by auto; auto.
    - destruct H as [-> H]; destruct (same_letter (cut _) (cut _)); auto.
      apply read_in_each_more; auto.
  Qed.
End Cut.
